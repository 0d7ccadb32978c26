// Telemetry as the plots keep it: a ring of columns with smallest and largest value of each.

import { Curves } from "./curves.js";
import { length } from "./length.js";

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
    if (frame.row < this.row) this.tags.fill(-1); // another loop counts from 0
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

  // Times of the columns from the oldest to the newest, twice each: for its least and its greatest value.
  times() { return this.twice((bin) => Array(2).fill(this.end(bin) - this.width / 2)); }

  // Values of a channel at these times, the nearer end first: a falling signal gives a line, not a saw.
  ends(channel, scale) {
    let pen = NaN;
    return this.twice((bin) => {
      const slot = bin % this.columns, at = (slot * this.channels + channel) * 2;
      const low = this.values[at] * scale, high = this.values[at + 1] * scale;
      if (this.tags[slot] !== bin || low !== low) return [null, null];
      const ends = pen - low > high - pen ? [high, low] : [low, high];
      pen = ends[1];
      return ends;
    });
  }

  twice(both) {
    const oldest = Math.max(this.newest - this.columns + 1, 0);
    return Array.from({ length: this.newest - oldest + 1 }, (_, k) => both(oldest + k)).flat();
  }
}

export class Plot {
  // lines: [channel, colour name, label, unit, digits]; without a unit places, in the page's, with so
  // many digits fewer than its finest. `stage`: whose it is alone, if any's.
  constructor(parent, title, lines, least, stage = "") {
    this.least = least;
    this.shown = [0, least];
    const figure = document.createElement("figure");
    figure.className = "plot";
    if (stage) figure.dataset.of = stage;
    this.caption = document.createElement("figcaption");
    this.marks = [];
    figure.append(this.caption);
    parent.append(figure);
    this.figure = figure;
    this.show(title, lines);
  }

  remove() {
    this.curves.remove();
    this.figure.remove();
  }

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
    this.curves?.remove();
    const about = `${title} over time; its present values are given above`;
    const range = () => this.shown, marks = () => this.marks;
    this.curves = new Curves(this.figure, about, lines.map((line) => line[1]), { range, marks });
  }

  get width() { return this.curves.width; }

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

  // The values shown. The span grows at once and shrinks only when it is far too large: a calm picture.
  fit(values) {
    let low = Infinity, high = -Infinity;
    for (const value of values) {
      if (value === null) continue;
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
    if (!(low <= high)) return;
    const pad = Math.max((high - low) * 0.08, (this.least * this.scale - (high - low)) / 2);
    low -= pad;
    high += pad;
    const [least, most] = this.shown, far = high - low < 0.6 * (most - least);
    if (far || low + pad / 2 < least || high - pad / 2 > most) this.shown = [low, high];
  }

  draw(ring, marks) {
    const values = this.lines.map(([channel]) => ring.ends(channel, this.scale));
    this.fit(values.flat());
    this.marks = marks.map(({ time }) => time);
    const end = ring.newest < 0 ? 0 : ring.end(ring.newest);
    this.curves.draw(ring.times(), values, end - ring.columns * ring.width, end);
  }
}
