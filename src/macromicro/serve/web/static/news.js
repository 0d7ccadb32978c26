// Events and ends of motions in words, and the marks that they leave in the plots.

import { length } from "./length.js";
import { names, said } from "./names.js";

const KEPT = 200;
const OUTCOMES = {
  done: "arrived and settled", stopped: "stopped", emergency: "ended by an emergency stop",
  fault: "ended by a fault", limit: "ended at a limit", stalled: "did not arrive in time",
  lost: "ended because its client was lost", superseded: "replaced by another one",
};

const SENTENCES = ["words", "evidence", "reason", "effect"]; // facts that need no name

export class News {
  constructor(list) { this.list = list; this.last = 0; this.marks = []; this.end = null; }

  take(items) {
    for (const item of items) {
      if (item.event <= this.last && item.event !== 1) continue;
      if (item.event < this.last) this.clear(); // another server
      this.last = item.event;
      if (item.kind === "loop" && item.cause === "started") this.marks = [];
      if (item.kind === "finished") this.end = item;
      if (["mode", "fault", "move", "gains"].includes(item.kind) && item.time !== null) {
        this.marks.push({ time: item.time });
        if (this.marks.length > KEPT) this.marks.shift();
      }
      const line = document.createElement("li");
      line.item = item;
      line.textContent = words(item);
      if (item.kind === "fault" || item.to_mode === "fault") line.className = "bad";
      this.list.prepend(line);
      if (this.list.children.length > KEPT) this.list.lastChild.remove();
    }
  }

  // In the unit that is chosen now.
  show() { for (const line of this.list.children) line.textContent = words(line.item); }

  clear() {
    this.list.replaceChildren();
    this.marks = [];
    this.end = null;
    this.last = 0;
  }
}

function words(item) { return `${item.time === null ? "-" : item.time.toFixed(3)} s  ${said(told(item))}`; }

function told(item) {
  if (item.kind === "finished") {
    const place = item.position === null ? "" : ` at ${length.words(item.position)}`;
    return `motion ${item.id} ${OUTCOMES[item.outcome] ?? item.outcome}${place}${facts(item)}`;
  }
  const change = item.kind === "mode" ? `${item.from_mode} to ${item.to_mode}: ` : `${item.kind}: `;
  return `${change}${item.cause}${facts(item)}`;
}

function facts({ kind, evidence }) {
  const parts = Object.entries(evidence ?? {}).map(([name, value]) => kind === "limits" ? limit(name, value) : fact(name, value));
  const shown = parts.filter((part) => part);
  return shown.length ? ` (${shown.join(", ")})` : "";
}

// The unit of a number is the end of its name: "error_um", "speed_m_per_s".
function fact(name, value) {
  if (SENTENCES.includes(name)) return value;
  if (typeof value !== "number") {
    return `${plain(name)} ${typeof value === "object" && value ? `${value.old} to ${value.new}` : value}`;
  }
  const [, what, unit, rate = ""] = /^(.+)_(m|mm|um|rad|deg|mdeg|counts)(_per_s)?$/.exec(name) ?? [];
  const counts = unit === "counts" && names.own && names.pitch; // of a machine of one stage: its own lengths
  const taken = unit && length.taken(counts ? value * names.pitch : value, counts ? length.base : unit);
  if (taken !== undefined) return counts && what === "target" ? "" : `${plain(what)} ${taken} ${length.name}${rate && "/s"}`;
  return `${plain(name)} ${Number.isInteger(value) ? value : Number(value.toPrecision(6))}`;
}

// A soft limit that was changed: of the whole in m, of the micro-stage in mm, of the macro-stage in counts.
function limit(name, { old, new: next }) {
  const unit = { whole: length.base, micro: "mm" }[name.split("_")[0]];
  if (names.own && !name.startsWith("whole")) return "";
  const value = (v) => unit ? length.taken(v, unit) : v;
  return `${plain(name)} ${value(old)} to ${value(next)} ${unit ? length.name : "counts"}`;
}

function plain(name) { return name.replaceAll("_", " "); }

export function outcome(end) {
  return end ? `Motion ${end.id} ${OUTCOMES[end.outcome] ?? end.outcome}.` : "";
}
