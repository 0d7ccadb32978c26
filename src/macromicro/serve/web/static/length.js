// One unit for every length on the page, or every angle of a machine that turns, chosen by the person.

const $ = (id) => document.getElementById(id);
const DIGITS = [4, 1]; // of a length in the larger unit, and in the smaller one
let units = { mm: { factor: 1e-3, digits: 4 }, um: { factor: 1e-6, digits: 1 } };
const KEY = "macromicro.unit";
const SIZES = { m: { m: 1, mm: 1e-3, um: 1e-6 }, rad: { rad: 1, deg: Math.PI / 180, mdeg: Math.PI / 180e3 } };
const NUMBER = "-?\\d+(?:\\.\\d+)?(?:e[+-]?\\d+)?";
const WORDS = new RegExp(`(${NUMBER})(?:( to | and )(${NUMBER}))? (m|mm|um|rad|deg|mdeg)(?![\\w^])`, "g");

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
    this.usual = unit;
    const kept = localStorage.getItem(this.key);
    this.name = $("unit").value = kept in units ? kept : unit;
    for (const u of Object.values(units)) {
      u.digits = Math.min(Math.max(u.digits, Math.ceil(-Math.log10(pitch / u.factor))), 7);
    }
    return this.name !== before;
  },

  base: "m",
  usual: "mm",

  // Where this browser keeps the choice: one for machines that are read in mm, one for those in um.
  get key() { return `${KEY}.${this.usual}`; },

  // The larger unit, in which telemetry comes; its size; digits behind its point.
  get main() { return Object.keys(units)[0]; },
  get scale() { return units[this.main].factor; },
  get finest() { return units[this.main].digits; },

  get factor() { return units[this.name].factor; },

  // A length [m] in words; `less`: digits fewer than the finest.
  words(metres, less = 0) {
    if (metres == null || !Number.isFinite(metres)) return "-";
    return `${(metres / this.factor).toFixed(this.digits(less))} ${this.name}`;
  },

  digits(less = 0) { return Math.max(units[this.name].digits - less, 0); },

  // A value in `unit` as a number in the page's unit; undefined where that measures something else.
  taken(value, unit) {
    const size = SIZES[this.base][unit];
    return size === undefined ? undefined : Number((value * size / this.factor).toPrecision(6));
  },

  // The same words with their lengths in the page's unit.
  said(words) {
    return words.replace(WORDS, (found, one, between, other, unit) => {
      if (unit === this.name || this.taken(1, unit) === undefined) return found;
      return `${this.taken(one, unit)}${between ? between + this.taken(other, unit) : ""} ${this.name}`;
    });
  },

  // The shortest text of a length [m], without a unit.
  short(metres) { return String(Number((metres / this.factor).toPrecision(9))); },
};

// Calls `changed` when another unit is chosen.
export function chooseUnit(changed) {
  const kept = localStorage.getItem(length.key);
  if (kept in units) length.name = kept;
  $("unit").value = length.name;
  $("unit").addEventListener("change", () => {
    length.name = $("unit").value;
    localStorage.setItem(length.key, length.name);
    changed();
  });
}
