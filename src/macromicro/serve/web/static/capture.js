// Captures of signals around an event: its settings, the captured curves, and a table of them.

import { Curves } from "./curves.js";
import { capital } from "./orders.js";
import { parsed } from "./numbers.js";
import { download } from "./steps.js";

const $ = (id) => document.getElementById(id);
const LOOK_MS = 300, MOST = 8;
const WORDS = { waiting: "Waiting for the trigger.", triggered: "Triggered.", complete: "Complete." };

export class Capture {
  constructor(link, page) {
    this.link = link;
    this.page = page;
    this.seen = 0;
    this.timer = 0;
    this.plots = [];
    this.curves = null; // { names, units, time_s, rows: one Float64Array of each name }
    $("capture-form").addEventListener("submit", (event) => { event.preventDefault(); this.start(); });
    $("capture-kind").addEventListener("change", () => this.suit());
    $("capture-stop").addEventListener("click", () => this.stop());
    $("capture-csv").addEventListener("click", () => download("capture.csv", this.table(), "text/csv"));
  }

  // The signals of this machine: [name, unit, meaning] of each.
  open(signals) {
    const key = signals.map(([name]) => name).join();
    clearInterval(this.timer);
    $("capture-state").textContent = "";
    if (this.key === key) return;
    this.key = key;
    for (const id of ["capture-signals", "capture-signal"]) {
      $(id).replaceChildren(...signals.map(([name, unit, meaning]) => {
        const option = new Option(`${name}${unit === "1" ? "" : ` [${unit}]`}`, name, false, name === "position");
        option.title = meaning;
        return option;
      }));
    }
    this.suit();
  }

  // Shows what the chosen trigger needs.
  suit() {
    const kind = $("capture-kind").value;
    for (const part of document.querySelectorAll("[data-watches]")) part.hidden = !["edge", "level"].includes(kind);
    const either = $("capture-slope").querySelector("[value=either]");
    either.disabled = kind === "level";
    if (either.disabled && either.selected) $("capture-slope").value = "rising";
  }

  async start() {
    const signals = [...$("capture-signals").selectedOptions].map((option) => option.value);
    const kind = $("capture-kind").value, trigger = { kind };
    const numbers = { before: parsed($("capture-before").value), after: parsed($("capture-after").value) };
    if (["edge", "level"].includes(kind)) {
      Object.assign(trigger, { signal: $("capture-signal").value, slope: $("capture-slope").value });
      trigger.threshold = numbers.threshold = parsed($("capture-threshold").value);
    }
    const wrong = Object.keys(numbers).find((name) => !Number.isFinite(numbers[name]));
    const problem = wrong ? `${capital(wrong)} Give a number.`
      : signals.length < 1 || signals.length > MOST ? `Choose 1 to ${MOST} signals.` : "";
    $("capture-problem").textContent = problem;
    if (problem) return;
    const { before, after } = numbers, repeat = $("capture-repeat").checked;
    const reply = await this.link.order("capture", { signals, trigger, before, after, repeat });
    if (!reply.ok) { $("capture-problem").textContent = `${capital(reply.reason)} ${capital(reply.remedy)}`; return; }
    this.seen = 0;
    clearInterval(this.timer);
    this.timer = setInterval(() => this.look(), LOOK_MS);
    this.look();
  }

  async stop() {
    clearInterval(this.timer);
    await this.link.order("end capture");
    $("capture-state").textContent = "Stopped.";
  }

  async look() {
    const reply = await this.link.order("captured", { seen: this.seen });
    if (!reply.ok) { clearInterval(this.timer); return; }
    if (reply.captured > this.seen) {
      const bytes = this.link.taken(reply.reply), size = reply.names.length;
      const values = new Float64Array(bytes.slice().buffer), rows = values.length / size;
      this.seen = reply.captured;
      this.curves = { ...reply, rows: reply.names.map((_, k) => values.subarray(k * rows, (k + 1) * rows)) };
      $("capture-csv").disabled = false;
      this.show();
    }
    const count = reply.captured > 1 || $("capture-repeat").checked ? ` ${reply.captured} captured.` : "";
    $("capture-state").textContent = WORDS[reply.phase] + count;
    if (reply.phase === "complete") clearInterval(this.timer);
  }

  table() {
    const { names, units, rows } = this.curves;
    const lines = [names.map((name, k) => `${name} [${units[k]}]`).join(",")];
    for (let n = 0; n < rows[0].length; n++) lines.push(rows.map((row) => Number(row[n].toPrecision(9))).join(","));
    return `${lines.join("\n")}\n`;
  }

  // A figure for each signal, with the trigger at 0 s.
  show() {
    const { names, units, rows } = this.curves, place = $("capture-plots");
    for (const plot of this.plots) plot.remove();
    place.replaceChildren();
    this.plots = names.slice(1).map((name, k) => {
      const figure = document.createElement("figure"), caption = document.createElement("figcaption");
      caption.textContent = units[k + 1] === "1" ? name : `${name} [${units[k + 1]}]`;
      figure.className = "plot";
      figure.append(caption);
      place.append(figure);
      return new Curves(figure, `${caption.textContent} around the trigger, at 0 s`, ["one"], { marks: () => [0] });
    });
    const [times, ...values] = rows;
    this.plots.forEach((plot, k) => plot.draw(times, [values[k]], times[0], times[times.length - 1]));
  }
}
