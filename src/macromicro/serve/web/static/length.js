// One unit for every length on the page, or every angle of a machine that turns, chosen by the person.

const $ = (id) => document.getElementById(id);
const DIGITS = [4, 1]; // of a length in the larger unit, and in the smaller one
let units = { mm: { factor: 1e-3, digits: 4 }, um: { factor: 1e-6, digits: 1 } };
const KEY = "macromicro.unit";

export const length = {
  name: "mm",

  // Takes the units of a machine and the one that suits it, unless a person has chosen one, and says
  // whether it is another; and as many digits as its count is worth, at least those that there are.
  suit({ unit, pitch, units: sizes, base }) {
    const before = this.name, names = Object.keys(sizes);
    this.base = base;
    if (names.join() !== Object.keys(units).join()) {
      units = Object.fromEntries(names.map((name, k) => [name, { factor: sizes[name], digits: DIGITS[k] }]));
      $("unit").replaceChildren(...names.map((name) => new Option(name)));
    }
    const kept = localStorage.getItem(KEY);
    this.name = $("unit").value = kept in units ? kept : unit;
    for (const u of Object.values(units)) {
      u.digits = Math.min(Math.max(u.digits, Math.ceil(-Math.log10(pitch / u.factor))), 7);
    }
    return this.name !== before;
  },

  base: "m",

  // The larger unit, in which telemetry comes; its size; digits behind its point.
  get main() { return Object.keys(units)[0]; },
  get scale() { return units[this.main].factor; },
  get finest() { return units[this.main].digits; },

  get factor() { return units[this.name].factor; },

  // A length [m] in words; `less`: digits fewer than the finest.
  words(metres, less = 0) {
    if (metres == null || !Number.isFinite(metres)) return "-";
    const { factor, digits } = units[this.name];
    return `${(metres / factor).toFixed(Math.max(digits - less, 0))} ${this.name}`;
  },

  // The shortest text of a length [m], without a unit.
  short(metres) { return String(Number((metres / this.factor).toPrecision(9))); },
};

// Calls `changed` when another unit is chosen.
export function chooseUnit(changed) {
  const kept = localStorage.getItem(KEY);
  if (kept in units) length.name = kept;
  $("unit").value = length.name;
  $("unit").addEventListener("change", () => {
    length.name = $("unit").value;
    localStorage.setItem(KEY, length.name);
    changed();
  });
}
