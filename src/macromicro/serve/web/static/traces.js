// Telemetry as the plots keep it: a ring of columns with smallest and largest value of each.

import { colours, decimals, niceStep, surface } from "./canvas.js";
import { length } from "./length.js";

const LEFT = 46, BOTTOM = 16, TOP = 6;
export const MARGIN = LEFT + 4;

export class Ring {
  // `period` [s]: of the loop, whose rows come one each.
  constructor(view, span, columns, channels, period) {
    const rows = Math.max(Math.round(span / period), 1);
    const width = Math.max(Math.ceil(rows / columns), 1);
    this.view = view;
    this.columns = Math.ceil(rows / width);
    this.channels = channels;
    this.values = new Float32Array(this.columns * channels * 2);
    this.tags = new Float64Array(this.columns).fill(-1);
    this.newest = -1;
    this.time = NaN;
    this.period = period;
    this.width = width * period;
    this.row = 0;
  }

  take(frame) {
    if (frame.view !== this.view || frame.channels !== this.channels) return;
    if (frame.row < this.row) this.tags.fill(-1); // another loop counts anew
    const size = this.channels * 2;
    for (let k = 0; k < frame.bins; k++) {
      const bin = frame.first + k, slot = bin % this.columns;
      this.values.set(frame.values.subarray(k * size, (k + 1) * size), slot * size);
      this.tags[slot] = bin;
    }
    this.newest = frame.first + frame.bins - 1;
    this.time = frame.time;
    this.row = frame.row;
  }

  // Time [s] at the right end of a column.
  end(bin) { return this.time + (bin + 1) * this.width - (this.row + 1) * this.period; }
}

export class Plot {
  // lines: [channel, colour name, label, unit, digits]; without a unit places, in the page's, with so
  // many digits fewer than its finest. `stage`: whose it is alone, if any's.
  constructor(parent, title, lines, least, stage = "") {
    this.least = least;
    this.low = 0;
    this.high = least;
    const figure = document.createElement("figure");
    figure.className = "plot";
    if (stage) figure.dataset.of = stage;
    this.caption = document.createElement("figcaption");
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.show(title, lines);
    figure.append(this.caption, this.canvas);
    parent.append(figure);
    this.figure = figure;
  }

  remove() { this.figure.remove(); }

  show(title, lines = this.lines) {
    this.lines = lines;
    const head = document.createElement("strong");
    head.textContent = title;
    this.caption.replaceChildren(head);
    this.outputs = lines.map(([, colour, label]) => {
      const item = document.createElement("span"), key = document.createElement("span");
      key.className = `key ${colour}`;
      const words = document.createTextNode("");
      item.append(key, label, " ", words);
      this.caption.append(item);
      return words;
    });
    this.canvas.setAttribute("aria-label", `${title} over time; its present values are given above`);
  }

  get width() { return this.canvas.clientWidth - MARGIN; }

  // What is shown of a value of the telemetry: places come in the machine's larger unit.
  get scale() { return this.lines.some((line) => line[3] === undefined) ? length.scale / length.factor : 1; }

  words(ring) {
    const slot = ring.newest % ring.columns;
    this.lines.forEach(([channel, , , unit, digits], k) => {
      const value = ring.newest < 0 ? NaN : ring.values[(slot * ring.channels + channel) * 2 + 1];
      const words = unit === undefined ? length.words(value * length.scale, digits) : `${value.toFixed(digits)} ${unit}`;
      this.outputs[k].data = Number.isFinite(value) ? words : "-";
    });
  }

  range(ring) {
    let low = Infinity, high = -Infinity;
    for (let slot = 0; slot < ring.columns; slot++) {
      if (ring.tags[slot] <= ring.newest - ring.columns || ring.tags[slot] < 0) continue;
      for (const [channel] of this.lines) {
        const at = (slot * ring.channels + channel) * 2;
        if (ring.values[at] < low) low = ring.values[at];
        if (ring.values[at + 1] > high) high = ring.values[at + 1];
      }
    }
    if (!(low <= high)) return;
    const pad = Math.max((high - low) * 0.08, (this.least - (high - low)) / 2);
    low -= pad;
    high += pad;
    // It grows at once and shrinks only when it is far too large: a calm picture.
    const far = high - low < 0.6 * (this.high - this.low);
    if (far || low + pad / 2 < this.low || high - pad / 2 > this.high) {
      this.low = low;
      this.high = high;
    }
  }

  draw(ring, marks) {
    const { g, width, height } = surface(this.canvas);
    const inner = width - MARGIN, bottom = height - BOTTOM;
    if (inner < 20) return;
    this.range(ring);
    const y = (v) => bottom - ((v - this.low) / (this.high - this.low)) * (bottom - TOP);
    const first = ring.newest - ring.columns + 1, dx = inner / ring.columns;
    const span = ring.columns * ring.width;
    const start = ring.newest < 0 ? 0 : ring.end(ring.newest) - span;
    const x = (t) => LEFT + ((t - start) / span) * inner;
    this.grid(g, { y, x, start, span, inner, bottom });
    g.save();
    g.beginPath();
    g.rect(LEFT, TOP, inner, bottom - TOP);
    g.clip();
    g.strokeStyle = colours.mark;
    g.setLineDash([3, 3]);
    g.beginPath();
    for (const { time } of marks) {
      if (time < start) continue;
      g.moveTo(x(time), TOP);
      g.lineTo(x(time), bottom);
    }
    g.stroke();
    g.setLineDash([]);
    g.lineWidth = 1.5;
    for (const [channel, colour] of this.lines) {
      g.strokeStyle = colours[colour];
      g.beginPath();
      let pen = NaN;
      for (let k = 0; k < ring.columns; k++) {
        const slot = (first + k + ring.columns) % ring.columns, at = (slot * ring.channels + channel) * 2;
        const low = ring.values[at], high = ring.values[at + 1];
        if (first + k < 0 || ring.tags[slot] !== first + k || low !== low) { pen = NaN; continue; }
        const px = LEFT + (k + 0.5) * dx;
        // The nearer end first: a falling signal gives a line, not a saw.
        const down = pen - low > high - pen, a = down ? high : low, b = down ? low : high;
        if (pen === pen) g.lineTo(px, y(a)); else g.moveTo(px, y(a));
        g.lineTo(px, y(b) - 0.01);
        pen = b;
      }
      g.stroke();
    }
    g.restore();
  }

  grid(g, { y, x, start, span, inner, bottom }) {
    g.strokeStyle = colours.line;
    g.fillStyle = colours.faint;
    g.textAlign = "right";
    g.textBaseline = "middle";
    g.beginPath();
    const scale = this.scale, low = this.low * scale, high = this.high * scale, step = niceStep(high - low, 4);
    for (let v = Math.ceil(low / step) * step; v <= high; v += step) {
      const at = y(v / scale);
      g.moveTo(LEFT, at);
      g.lineTo(LEFT + inner, at);
      g.fillText(v.toFixed(decimals(step)), LEFT - 4, Math.max(at, 6));
    }
    g.textAlign = "center";
    g.textBaseline = "top";
    const pace = niceStep(span, Math.max(inner / 90, 2));
    for (let t = Math.ceil(start / pace) * pace; t <= start + span; t += pace) {
      if (t < 0) continue;
      g.moveTo(x(t), TOP);
      g.lineTo(x(t), bottom);
      const end = x(t) > LEFT + inner - 18 || x(t) < LEFT + 10;
      if (!end) g.fillText(`${t.toFixed(decimals(pace))} s`, x(t), bottom + 3);
    }
    g.stroke();
  }
}
