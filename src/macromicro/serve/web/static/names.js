// What the page calls the stages and modes of this machine. The protocol's words, and the loop's, are
// those of the thesis' machine: "macro" is the only stage of a piezo or an axis as well.

import { length } from "./length.js";

export const names = {
  own: false, // Is it another machine than the thesis'?
  stages: { macro: "macro-stage", micro: "micro-stage" },

  open(server) {
    this.own = Boolean(server.model);
    this.stages = server.names;
    this.pitch = server.stages.length === 1 ? server.limits.pitch : 0; // m a count of the only stage
    for (const part of document.querySelectorAll("[data-label]")) {
      const stage = part.closest("[data-stage]").dataset.stage;
      if (stage in this.stages) part.setAttribute("aria-label", part.dataset.label.replace("{}", this.stages[stage]));
    }
  },

  title(stage) {
    const name = this.stages[stage] ?? stage;
    return name[0].toUpperCase() + name.slice(1);
  },
};

// Words of the server as this machine's page has them: its stage, and lengths in the page's unit.
export function said(words) {
  return length.said(!names.own ? words : words
    .replace(/\bmoving-macro\b/g, "moving")
    .replace(/\b(jog|move|follow) macro\b/g, "$1").replace(/\bmacro (jog|move|follow)\b/g, "$1")
    .replace(/\bmacro-stage\b/g, names.stages.macro ?? "axis"));
}
