// Steps of a chosen length, and points that were taught.

import { length } from "./length.js";

const $ = (id) => document.getElementById(id);
const STEPS = [1e-3, 1e-2, 0.1, 1, 10]; // mm or deg
const MOST = 50;

export class Steps {
  constructor(orders, page) {
    this.orders = orders;
    this.page = page;
    for (const button of document.querySelectorAll(".step-button")) {
      const stage = button.closest(".jog").dataset.stage, sign = Number(button.dataset.sign);
      button.addEventListener("click", () => this.step(stage, sign * Number($("step").value)));
    }
    this.units();
  }

  // Steps that fit into the travel: the one chosen, or where that does not fit the longest below a
  // twentieth of it.
  units() {
    const limits = this.page.limits, travel = limits ? limits.whole_high - limits.whole_low : Infinity;
    const fitting = STEPS.map((step) => Number((step * length.scale).toPrecision(12))).filter((step) => step <= travel);
    const chosen = Number($("step").value || length.scale);
    $("step").replaceChildren(...fitting.map((step) => new Option(`${length.short(step)} ${length.name}`, step)));
    $("step").value = String(fitting.includes(chosen) ? chosen : fitting.findLast((step) => step <= 0.05 * travel) ?? fitting[0]);
  }

  // One step [m] of a stage; the machine adds it to its last target.
  step(stage, distance) {
    const give = (what, fields) => this.orders.give(what, fields, "Step");
    if (stage === "whole" || stage === "macro" && this.page.alone) return give("move by", { value: distance, unit: length.base });
    if (stage === "macro") {
      const counts = distance / this.page.limits.pitch;
      if (Math.abs(counts) < 1) return this.page.say(`Step: refused. A step of ${length.words(Math.abs(distance))} is less ` +
        "than one count of the macro-stage. Choose a longer one.", true);
      return give("move macro by", { value: counts });
    }
    return give("move micro by", { value: distance, unit: "m" });
  }
}

export class Points {
  constructor(orders, page) {
    this.orders = orders;
    this.page = page;
    this.rig = null;
    this.list = [];
    $("teach").addEventListener("click", () => this.teach());
    $("points-save").addEventListener("click", () => this.save());
  }

  // The points of this machine, as this browser keeps them; `alone`: it has one stage.
  open(rig, alone) {
    this.alone = alone;
    if (this.rig === rig) return;
    this.rig = rig;
    try { this.list = JSON.parse(localStorage.getItem(this.key) ?? "[]"); } catch { this.list = []; }
    if (!Array.isArray(this.list)) this.list = [];
    this.show();
  }

  get key() { return `macromicro.points.${this.rig}`; }

  teach() {
    const now = this.page.state;
    if (!now.trusted || now.position_m == null) {
      return this.page.say("Point: not saved. The position is not known. Home first.", true);
    }
    if (this.list.length >= MOST) return this.page.say(`Point: not saved. There are ${MOST} points. Delete one.`, true);
    const place = now.target_m ?? now.position_m;
    this.list.push({ name: `point ${this.list.length + 1}`, place, macro: Math.round(now.macro_count), micro: Math.max(now.micro_mm, 0) });
    this.keep();
    return this.page.say(`Point saved at ${length.words(place)}.`);
  }

  keep() {
    localStorage.setItem(this.key, JSON.stringify(this.list));
    this.show();
  }

  show() {
    $("point-list").replaceChildren(...this.list.map((point, k) => {
      const line = document.createElement("li"), name = document.createElement("input");
      name.value = point.name;
      name.maxLength = 40;
      name.setAttribute("aria-label", `Name of point ${k + 1}`);
      name.addEventListener("change", () => { point.name = name.value; this.keep(); });
      const go = button("Go", `Move to ${point.name}`, () => this.orders.give("move to", { value: point.place, unit: length.base }, point.name));
      go.dataset.possible = "move to";
      const drop = button("Delete", `Delete ${point.name}`, () => { this.list.splice(k, 1); this.keep(); });
      line.append(name, ` ${length.words(point.place)} `, go, " ", drop);
      return line;
    }));
  }

  // A motion programme that visits the points in turn.
  save() {
    if (!this.list.length) return this.page.say("There are no points to save. Save a position first.", true);
    const move = (stage, target, hold) => `[[moves]]\n${stage} = "${target}"\nhold = "${hold}"\n`;
    const text = this.list.map((point) => `# ${point.name.replace(/[^\x20-\x7e]/g, "?")}\n` +
      (this.alone ? move("to", `${(point.place / length.scale).toFixed(6)} ${length.main}`, "2 s")
        : move("macro", `${point.macro} counts`, "0.1 s") + move("micro", `${point.micro.toFixed(4)} mm`, "2 s"))).join("\n");
    return download("points.toml", text, "application/toml");
  }
}

function button(words, label, action) {
  const found = document.createElement("button");
  found.type = "button";
  found.textContent = words;
  found.setAttribute("aria-label", label);
  found.addEventListener("click", action);
  return found;
}

export function download(name, text, type) {
  const anchor = document.createElement("a");
  anchor.href = URL.createObjectURL(new Blob([text], { type }));
  anchor.download = name;
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(anchor.href), 60000);
}
