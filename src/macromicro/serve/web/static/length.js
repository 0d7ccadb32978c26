// One unit for every length on the page, chosen by the person.

const $ = (id) => document.getElementById(id);
const UNITS = { mm: { factor: 1e-3, digits: 4 }, um: { factor: 1e-6, digits: 1 } };
const KEY = "macromicro.unit";

export const length = {
  name: "mm",
  get factor() { return UNITS[this.name].factor; },

  // A length [m] in words; `less`: digits fewer than the finest.
  words(metres, less = 0) {
    if (metres == null || !Number.isFinite(metres)) return "-";
    const { factor, digits } = UNITS[this.name];
    return `${(metres / factor).toFixed(Math.max(digits - less, 0))} ${this.name}`;
  },

  // The shortest text of a length [m], without a unit.
  short(metres) { return String(Number((metres / this.factor).toPrecision(9))); },
};

// Calls `changed` when another unit is chosen.
export function chooseUnit(changed) {
  const kept = localStorage.getItem(KEY);
  if (kept in UNITS) length.name = kept;
  $("unit").value = length.name;
  $("unit").addEventListener("change", () => {
    length.name = $("unit").value;
    localStorage.setItem(KEY, length.name);
    changed();
  });
}
