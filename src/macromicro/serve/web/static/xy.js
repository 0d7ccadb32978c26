// Both axes of a machine of two: the picture of the plane, and moves to a point.

import { colours, decimals, niceStep, surface } from "./canvas.js";
import { length } from "./length.js";
import { outside } from "./orders.js";

const $ = (id) => document.getElementById(id);
const X = 7, Y_AIM = 8, Y = 9, X_AIM = 0; // channels of the telemetry
const MARGIN = 44, EDGE = 8; // of the picture: for the numbers, and at the other sides
export const FIRST = 8; // channels of a machine of one place

export class Plane {
  constructor(orders, page) {
    this.orders = orders;
    this.page = page;
    this.axes = [];
    this.proposed = null;
    $("plane-xy").addEventListener("click", (event) => this.pick(event));
    $("point-form").addEventListener("submit", (event) => this.move(event));
  }

  // The axes of this machine; none: the page shows one place.
  open(axes) {
    this.axes = axes;
    for (const part of document.querySelectorAll("[data-places]")) part.hidden = (part.dataset.places === "two") !== axes.length > 0;
    if (axes.length) $("plane-xy").style.aspectRatio = String(Math.min(Math.max(this.span(0) / this.span(1), 0.75), 3));
  }

  get there() { return this.axes.length > 0; }
  span(k) { return this.axes[k].high - this.axes[k].low; }

  // The place in words; of each axis its own.
  words(now) {
    $("point-unit").textContent = length.name;
    return now.axes.map((axis) => `${axis.name} ${length.words(axis.position_m)}`).join(", ");
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

  pick(event) {
    if (!this.there) return;
    const { at, point } = this.under(event);
    if (point.some((m, k) => m < this.axes[k].low || m > this.axes[k].high)) return;
    const step = 10 ** Math.floor(Math.log10(1 / at.unit)); // m; what a pixel can tell
    const digits = Math.max(0, Math.round(Math.log10(length.factor / step)));
    ["point-x", "point-y"].forEach((id, k) => { $(id).value = (point[k] / length.factor).toFixed(digits); });
    this.proposed = point;
    $("point-problem").textContent = "";
    this.page.say(`Point ${point.map((m) => length.words(m)).join(", ")} filled in. Press Move to go there.`);
  }

  // Checks here, so that a slip is reported at once; the server and the machine check again.
  move(event) {
    event.preventDefault();
    const values = ["point-x", "point-y"].map((id) => Number($(id).value.trim().replace(",", ".") || NaN));
    const problem = values.map((value, k) => this.beyond(value, this.axes[k])).find((words) => words) ?? "";
    $("point-problem").textContent = problem;
    if (problem) return;
    this.orders.give("move point", { x: values[0], y: values[1], unit: length.name }, "Move");
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
    if (!this.there) return;
    const { g, width, height } = surface($("plane-xy"));
    if (width < 2 * MARGIN) return;
    const at = this.scale(width, height);
    this.grid(g, at);
    if (ring && this.there) {
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
