// Captures of signals around an event: its settings, the captured curves, and a table of them.

import { colours, decimals, niceStep, surface } from "./canvas.js";
import { capital } from "./orders.js";
import { parsed } from "./numbers.js";
import { download } from "./steps.js";

const $ = (id) => document.getElementById(id);
const LOOK_MS = 300, MOST = 8, LEFT = 64, BOTTOM = 18, TOP = 6;
const WORDS = { waiting: "Waiting for the trigger.", triggered: "Triggered.", complete: "Complete." };

export class Capture {
  constructor(link, page) {
    this.link = link;
    this.page = page;
    this.seen = 0;
    this.timer = 0;
    this.curves = null; // { names, units, time_s, rows: one Float64Array of each name }
    $("capture-form").addEventListener("submit", (event) => { event.preventDefault(); this.start(); });
    $("capture-kind").addEventListener("change", () => this.suit());
    $("capture-stop").addEventListener("click", () => this.stop());
    $("capture-csv").addEventListener("click", () => download("capture.csv", this.table(), "text/csv"));
    new ResizeObserver(() => this.draw()).observe($("capture-plots"));
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
      this.draw();
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

  draw() {
    if (!this.curves) return;
    const { names, units, rows } = this.curves, place = $("capture-plots");
    while (place.children.length > names.length - 1) place.lastChild.remove();
    names.slice(1).forEach((name, k) => {
      if (!place.children[k]) place.append(figure());
      const [caption, canvas] = place.children[k].children;
      const unit = units[k + 1] === "1" ? "" : ` [${units[k + 1]}]`;
      caption.textContent = `${name}${unit}`;
      canvas.setAttribute("aria-label", `${name}${unit} around the trigger, at 0 s`);
      plot(canvas, rows[0], rows[k + 1]);
    });
  }
}

function figure() {
  const made = document.createElement("figure"), canvas = document.createElement("canvas");
  made.className = "plot";
  canvas.setAttribute("role", "img");
  made.append(document.createElement("figcaption"), canvas);
  return made;
}

function plot(canvas, time, values) {
  const { g, width, height } = surface(canvas), inner = width - LEFT - 8, bottom = height - BOTTOM;
  if (inner < 20) return;
  let low = Infinity, high = -Infinity;
  for (const value of values) { if (value < low) low = value; if (value > high) high = value; }
  if (!(low <= high)) return;
  const pad = (high - low || Math.abs(high) * 1e-3 || 1) * 0.08, from = time[0], span = time[time.length - 1] - from || 1;
  low -= pad;
  high += pad;
  const x = (t) => LEFT + ((t - from) / span) * inner, y = (v) => bottom - ((v - low) / (high - low)) * (bottom - TOP);
  g.strokeStyle = colours.line;
  g.fillStyle = colours.faint;
  g.textAlign = "right";
  g.textBaseline = "middle";
  g.beginPath();
  const step = niceStep(high - low, 4), pace = niceStep(span, Math.max(inner / 90, 2));
  for (let v = Math.ceil(low / step) * step; v <= high; v += step) {
    g.moveTo(LEFT, y(v));
    g.lineTo(LEFT + inner, y(v));
    g.fillText(v.toFixed(decimals(step)), LEFT - 4, Math.max(y(v), 6));
  }
  g.textAlign = "center";
  g.textBaseline = "top";
  for (let t = Math.ceil(from / pace) * pace; t <= from + span; t += pace) {
    g.moveTo(x(t), TOP);
    g.lineTo(x(t), bottom);
    if (x(t) > LEFT + 10 && x(t) < LEFT + inner - 18) g.fillText(`${(t || 0).toFixed(decimals(pace))} s`, x(t), bottom + 3);
  }
  g.stroke();
  g.strokeStyle = colours.mark;
  g.setLineDash([3, 3]);
  g.beginPath();
  g.moveTo(x(0), TOP);
  g.lineTo(x(0), bottom);
  g.stroke();
  g.setLineDash([]);
  g.strokeStyle = colours.one;
  g.lineWidth = 1.5;
  g.beginPath();
  // Of the rows within one pixel the least and the greatest are drawn.
  for (let n = 0; n < time.length;) {
    const column = Math.floor(x(time[n]));
    let least = values[n], most = values[n];
    for (n++; n < time.length && Math.floor(x(time[n])) === column; n++) {
      least = Math.min(least, values[n]);
      most = Math.max(most, values[n]);
    }
    g.lineTo(column, y(least));
    if (most > least) g.lineTo(column, y(most));
  }
  g.stroke();
  g.lineWidth = 1;
}
