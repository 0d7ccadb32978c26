// One unit for every length on the page, chosen by the person.

const $ = (id) => document.getElementById(id);
const UNITS = { mm: { factor: 1e-3, digits: 4 }, um: { factor: 1e-6, digits: 1 } };
const KEY = "macromicro.unit";

export const length = {
  name: "mm",

  // Takes the unit that suits a machine, unless a person has chosen one, and says whether it is
  // another; and as many digits as its count [m] is worth, at least those that there are.
  suit(unit, pitch) {
    const before = this.name;
    if (!(localStorage.getItem(KEY) in UNITS)) this.name = $("unit").value = unit;
    for (const u of Object.values(UNITS)) {
      u.digits = Math.min(Math.max(u.digits, Math.ceil(-Math.log10(pitch / u.factor))), 7);
    }
    return this.name !== before;
  },

  // Digits behind the point of a length in mm.
  get finest() { return UNITS.mm.digits; },

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
