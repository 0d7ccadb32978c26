// The stages of a machine of several: a field, a row of buttons and plots of each, moves to a point,
// and the picture of a plane, or a ruler of each.

import { colours, decimals, niceStep, surface } from "./canvas.js";
import { length } from "./length.js";
import { outside } from "./orders.js";
import { Ruler } from "./ruler.js";
import { Plot } from "./traces.js";

const $ = (id) => document.getElementById(id);
const X = 7, Y_AIM = 8, Y = 9, X_AIM = 0; // channels of the telemetry
const OF_STAGE = 3; // channels of each further stage: set point, position, effort
const MARGIN = 44, EDGE = 8; // of the picture: for the numbers, and at the other sides
export const FIRST = 8; // channels of a machine of one place

export class Stages {
  constructor(orders, page) {
    this.orders = orders;
    this.page = page;
    this.axes = [];
    this.rulers = [];
    this.plots = [];
    this.proposed = null;
    $("plane-xy").addEventListener("click", (event) => this.pick(event));
    $("point-form").addEventListener("submit", (event) => this.move(event));
  }

  // The stages of this machine; none: the page shows one place. `plane`: the first two are seen from
  // above; `efforts`: name and unit of each stage's.
  open(axes, plane, efforts) {
    const same = JSON.stringify(axes) === JSON.stringify(this.axes);
    this.axes = axes;
    this.plane = plane;
    for (const part of document.querySelectorAll("[data-places]")) part.hidden = (part.dataset.places === "several") !== axes.length > 0;
    $("plane-xy").hidden = $("drag-follows-xy").parentElement.hidden = !plane;
    $("position").classList.toggle("several", axes.length > 0);
    if (plane) $("plane-xy").style.aspectRatio = String(Math.min(Math.max(this.span(0) / this.span(1), 0.75), 3));
    if (same) return;
    $("point-fields").replaceChildren(...axes.flatMap(({ name }) => this.field(name)));
    $("axis-jogs").replaceChildren(...axes.map(({ name }) => this.row(name)));
    this.rulers = plane ? [] : axes.map((axis, k) => this.ruler(axis, k));
    $("axis-rulers").replaceChildren(...this.rulers.flatMap(({ title, canvas }) => [title, canvas]));
    for (const plot of this.plots) plot.remove();
    this.plots = axes.slice(1).flatMap((axis, k) => this.plotted(axis, FIRST + OF_STAGE * k, efforts));
  }

  field(name) {
    const label = document.createElement("label"), input = document.createElement("input");
    input.id = label.htmlFor = `point-${name}`;
    label.textContent = name;
    input.inputMode = "decimal";
    input.autocomplete = "off";
    input.setAttribute("aria-describedby", "point-problem");
    return [label, " ", input, " "];
  }

  row(name) {
    const row = $("axis-jog").content.firstElementChild.cloneNode(true);
    row.dataset.stage = name;
    row.querySelector("span").textContent = name;
    for (const part of row.querySelectorAll("[aria-label]")) part.setAttribute("aria-label", part.getAttribute("aria-label").replace("{}", name));
    for (const button of row.querySelectorAll(".jog-button")) this.orders.hold(button);
    for (const button of row.querySelectorAll(".step-button")) {
      button.addEventListener("click", () => this.step(name, Number(button.dataset.sign) * Number($("step").value)));
    }
    return row;
  }

  ruler({ name, low, high }, k) {
    const title = document.createElement("h3"), canvas = document.createElement("canvas");
    title.textContent = `Axis ${name}`;
    canvas.className = "ruler";
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `Position of ${name} on four scales. Click to propose a target.`);
    const ruler = new Ruler(canvas, (value, step) => this.fill(k, value * length.scale, step * length.scale));
    ruler.limits = { whole_low: low, whole_high: high };
    return { title, canvas, ruler };
  }

  plotted({ name, low, high }, first, efforts) {
    const [label, unit] = efforts[name] ?? ["effort", "V"], least = Math.min(0.5, (high - low) / length.scale / 20);
    return [
      new Plot($("plots"), `Axis ${name}`, [[first, "two", "reference", , 1], [first + 1, "one", "position", , 1]], least),
      new Plot($("plots"), `Effort of ${name}`, [[first + 2, "two", label, unit, 2]], 1),
    ];
  }

  get there() { return this.axes.length > 0; }
  span(k) { return this.axes[k].high - this.axes[k].low; }

  // The place in words; of each stage its own.
  words(now) {
    $("point-unit").textContent = length.name;
    return now.axes.map((axis) => `${axis.name} ${length.words(axis.position_m)}`.replaceAll(" ", "\u00a0")).join(", ");
  }

  // Half widths, set points and limits in words.
  within(now) { return length.words(Math.max(...now.axes.map((axis) => axis.uncertainty_m ?? NaN))); }

  limits() {
    const one = ({ name, low, high }) => `${name} ${length.short(low)} to ${length.short(high)} ${length.name}`;
    return `Travel: ${this.axes.map(one).join(", ")}`;
  }

  // From metres to the canvas: the travel of both axes at one scale, y upwards.
  scale(width, height) {
    const inner = width - MARGIN - EDGE, upper = height - EDGE - 18;
    const unit = Math.min(inner / this.span(0), upper / this.span(1));
    const [x, y] = this.axes;
    return {
      unit,
      x: (m) => MARGIN + (m - x.low) * unit, y: (m) => EDGE + upper - (m - y.low) * unit,
      back: (px, py) => [x.low + (px - MARGIN) / unit, y.low + (EDGE + upper - py) / unit],
    };
  }

  // The point [m] under the pointer, and the scale of the picture.
  under(event) {
    const canvas = $("plane-xy"), at = this.scale(canvas.clientWidth, canvas.clientHeight);
    return { at, point: at.back(event.offsetX, event.offsetY) };
  }

  // The set point of each stage under the pointer; those that the picture does not show stay.
  followed(event, now) {
    const { point } = this.under(event);
    const place = (axis, k) => point[k] ?? axis.target_m ?? axis.position_m;
    return Object.fromEntries(now.axes.map((axis, k) => [axis.name, place(axis, k)]));
  }

  pick(event) {
    if (!this.there) return;
    const { at, point } = this.under(event);
    if (point.some((m, k) => m < this.axes[k].low || m > this.axes[k].high)) return;
    const step = 10 ** Math.floor(Math.log10(1 / at.unit)); // m; what a pixel can tell
    point.forEach((m, k) => this.fill(k, m, step));
    this.proposed = point;
    this.page.say(`Point ${point.map((m) => length.words(m)).join(", ")} filled in. Press Move to go there.`);
  }

  // Fills in the target [m] of a stage, to `step`.
  fill(k, metres, step) {
    const digits = Math.max(0, Math.round(Math.log10(length.factor / step)));
    $(`point-${this.axes[k].name}`).value = (metres / length.factor).toFixed(digits);
    $("point-problem").textContent = "";
  }

  // Checks here, so that a slip is reported at once; the server and the machine check again. Stages
  // without a number stand.
  move(event) {
    event.preventDefault();
    const texts = this.axes.map((axis) => [axis, $(`point-${axis.name}`).value.trim().replace(",", ".")]);
    const given = texts.filter(([, text]) => text !== "").map(([axis, text]) => [axis, Number(text)]);
    const problem = given.map(([axis, value]) => this.beyond(value, axis)).find((words) => words) ?? "";
    $("point-problem").textContent = given.length ? problem : "Give a number.";
    if (problem || !given.length) return;
    const point = Object.fromEntries(given.map(([{ name }, value]) => [name, value]));
    this.orders.give("move point", { ...point, unit: length.name }, "Move");
  }

  beyond(value, { name, low, high }) {
    if (!Number.isFinite(value)) return `${name}: give a number.`;
    const problem = outside(value * length.factor, low, high);
    return problem && `${name}: ${problem}`;
  }

  // One step [m] of an axis; the machine adds it to its last target.
  step(name, distance) {
    this.orders.give("move axis by", { axis: name, value: distance, unit: length.base }, "Step");
  }

  draw(ring, now, live) {
    for (const plot of this.plots) plot.draw(ring, this.page.marks());
    this.rulers.forEach(({ ruler }, k) => this.measure(ruler, now.axes?.[k], live));
    if (!this.plane) return;
    const { g, width, height } = surface($("plane-xy"));
    if (width < 2 * MARGIN) return;
    const at = this.scale(width, height);
    this.grid(g, at);
    if (ring) {
      this.trail(g, at, ring, [X_AIM, Y_AIM], colours.two);
      this.trail(g, at, ring, [X, Y], colours.one);
    }
    if (this.proposed) this.cross(g, at.x(this.proposed[0]), at.y(this.proposed[1]), colours.mark);
    if (!now.axes?.length || now.axes.some((axis) => axis.position_m == null)) return;
    const [x, y] = now.axes.map((axis) => axis.position_m);
    g.fillStyle = g.strokeStyle = colours.ink;
    g.beginPath();
    g.arc(at.x(x), at.y(y), 5, 0, 2 * Math.PI);
    if (live) g.fill(); else g.stroke();
  }

  measure(ruler, axis, live) {
    if (!axis || axis.position_m == null) return;
    const position = axis.position_m / length.scale, target = axis.target_m == null ? NaN : axis.target_m / length.scale;
    const uncertainty = (axis.uncertainty_m ?? NaN) / length.scale * 1e3; // in the unit of telemetry
    ruler.draw({ position, macro: position, micro: 0, uncertainty, target, live, unit: length });
  }

  grid(g, at) {
    const [x, y] = this.axes;
    g.strokeStyle = colours.line;
    g.fillStyle = colours.faint;
    g.beginPath();
    const step = niceStep(this.span(0) / length.factor, 6) * length.factor, digits = decimals(step / length.factor);
    g.textAlign = "center";
    g.textBaseline = "top";
    for (let m = Math.ceil(x.low / step) * step; m <= x.high; m += step) {
      g.moveTo(at.x(m), at.y(y.low));
      g.lineTo(at.x(m), at.y(y.high));
      g.fillText((m / length.factor).toFixed(digits), at.x(m), at.y(y.low) + 3);
    }
    g.textAlign = "right";
    g.textBaseline = "middle";
    for (let m = Math.ceil(y.low / step) * step; m <= y.high; m += step) {
      g.moveTo(at.x(x.low), at.y(m));
      g.lineTo(at.x(x.high), at.y(m));
      g.fillText((m / length.factor).toFixed(digits), at.x(x.low) - 4, at.y(m));
    }
    g.rect(at.x(x.low), at.y(y.high), this.span(0) * at.unit, this.span(1) * at.unit);
    g.stroke();
  }

  // Where both were in the span of the plots, oldest first.
  trail(g, at, ring, [x, y], colour) {
    g.strokeStyle = colour;
    g.lineWidth = 1.5;
    g.beginPath();
    let pen = false;
    for (let k = 0; k < ring.columns; k++) {
      const bin = ring.newest - ring.columns + 1 + k, slot = (bin + ring.columns) % ring.columns;
      const mean = (channel) => {
        const place = (slot * ring.channels + channel) * 2;
        return (ring.values[place] + ring.values[place + 1]) / 2 * length.scale;
      };
      if (bin < 0 || ring.tags[slot] !== bin || Number.isNaN(mean(x)) || Number.isNaN(mean(y))) { pen = false; continue; }
      if (pen) g.lineTo(at.x(mean(x)), at.y(mean(y))); else g.moveTo(at.x(mean(x)), at.y(mean(y)));
      pen = true;
    }
    g.stroke();
    g.lineWidth = 1;
  }

  cross(g, x, y, colour) {
    g.strokeStyle = colour;
    g.beginPath();
    for (const [dx, dy] of [[6, 0], [0, 6]]) {
      g.moveTo(x - dx, y - dy);
      g.lineTo(x + dx, y + dy);
    }
    g.stroke();
  }
}
