// Events and ends of motions in words, and the marks that they leave in the plots.

import { length } from "./length.js";

const KEPT = 200;
const OUTCOMES = {
  done: "arrived and settled", stopped: "stopped", emergency: "cut off by an emergency stop",
  fault: "cut off by a fault", limit: "ended at a limit", stalled: "did not arrive in time",
  lost: "ended because its client was lost", superseded: "replaced by another one",
};

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
      line.textContent = `${item.time === null ? "-" : item.time.toFixed(3)} s  ${words(item)}`;
      if (item.kind === "fault" || item.to_mode === "fault") line.className = "bad";
      this.list.prepend(line);
      if (this.list.children.length > KEPT) this.list.lastChild.remove();
    }
  }

  clear() {
    this.list.replaceChildren();
    this.marks = [];
    this.end = null;
    this.last = 0;
  }
}

function words(item) {
  if (item.kind === "finished") {
    const place = item.position === null ? "" : ` at ${(item.position / length.scale).toFixed(4)} ${length.main}`;
    return `motion ${item.id} ${OUTCOMES[item.outcome] ?? item.outcome}${place}${facts(item.evidence)}`;
  }
  const change = item.kind === "mode" ? `${item.from_mode} to ${item.to_mode}: ` : `${item.kind}: `;
  return `${change}${item.cause}${facts(item.evidence)}`;
}

function facts(evidence) {
  const parts = Object.entries(evidence ?? {}).map(([name, value]) => {
    const shown = typeof value === "number" && !Number.isInteger(value) ? Number(value.toPrecision(6)) : value;
    return `${name} ${typeof shown === "object" && shown ? `${shown.old} to ${shown.new}` : shown}`;
  });
  return parts.length ? ` (${parts.join(", ")})` : "";
}

export function outcome(end) {
  return end ? `Motion ${end.id} ${OUTCOMES[end.outcome] ?? end.outcome}.` : "";
}
