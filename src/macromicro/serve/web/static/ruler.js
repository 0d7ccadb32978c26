// Both stages on one ruler, on four scales: each window shows a part of the one above.

import { colours, decimals, niceStep, surface } from "./canvas.js";

const MICRON = 1e-3, GRAB = 0.5; // mm; share of a strip that its scale takes
const SPANS = [null, 4, 0.1, 0.01]; // mm; the first is the travel

// The windows [mm]: of a travel that is not much longer than the second, each a part of the last.
export function spans(travel) {
  return travel > 2 * SPANS[1] ? SPANS : [null, travel / 5, travel / 50, travel / 500];
}

// The value [mm] at a place of a scale.
export function valueAt(scale, event) { return scale.from + ((event.offsetX - scale.left) / scale.inner) * scale.span; }

export class Ruler {
  // pick(position [mm], the scale's resolution [mm]): somebody clicked there.
  constructor(canvas, pick) {
    this.canvas = canvas;
    this.limits = null;
    this.scales = [];
    this.proposed = NaN;
    canvas.addEventListener("click", (event) => {
      const scale = this.scaleAt(event);
      if (!scale) return;
      const value = valueAt(scale, event);
      const step = 10 ** Math.floor(Math.log10(scale.span / scale.inner));
      if (value >= scale.from && value <= scale.from + scale.span) pick(Math.round(value / step) * step, step);
    });
  }

  scaleAt(event) { return this.scales.findLast((s) => event.offsetY >= s.top); }

  // place: {position, macro, micro} mm, uncertainty um, target mm or NaN; live: is it known and
  // of this moment? unit: {factor [m], name} of the labels. Of a machine that turns deg for mm.
  draw(place) {
    const { g, width, height } = surface(this.canvas);
    if (!this.limits || !Number.isFinite(place.position)) return;
    const scale = place.unit.scale, low = this.limits.whole_low / scale, high = this.limits.whole_high / scale;
    const centre = Number.isFinite(place.target) ? place.target : place.position;
    this.scales = [];
    const windows = spans(high - low), row = height / windows.length;
    const left = 56, inner = width - left - 8;
    let above = null;
    windows.forEach((window, k) => {
      const span = window ?? high - low;
      const from = k === 0 ? low : centre - span / 2;
      const strip = { from, span, left, inner, top: k * row, row, x: (v) => left + ((v - from) / span) * inner };
      if (above) this.wedge(g, above, strip);
      this.strip(g, window, strip, place, k);
      this.scales.push(strip);
      above = strip;
    });
  }

  // Which part of the window above this one shows.
  wedge(g, above, below) {
    const y0 = above.top + above.row * GRAB + 19, y1 = below.top + below.row * GRAB - 15;
    g.fillStyle = colours.box;
    g.beginPath();
    g.moveTo(above.x(below.from), y0);
    g.lineTo(above.x(below.from + below.span), y0);
    g.lineTo(below.left + below.inner, y1);
    g.lineTo(below.left, y1);
    g.fill();
  }

  strip(g, window, s, place, k) {
    const base = s.top + s.row * GRAB, inside = (v) => v >= s.from && v <= s.from + s.span;
    const clamp = (v) => Math.min(Math.max(s.x(v), s.left), s.left + s.inner);
    g.strokeStyle = colours.ink;
    g.fillStyle = colours.faint;
    g.textBaseline = "middle";
    g.textAlign = "left";
    g.fillText(window ? this.spoken(window, place.unit) : "travel", 2, base);
    g.textAlign = "center";
    g.textBaseline = "top";
    g.beginPath();
    g.moveTo(s.left, base);
    g.lineTo(s.left + s.inner, base);
    const step = niceStep(s.span, Math.max(s.inner / 75, 2)), digits = decimals(step);
    for (let v = Math.ceil(s.from / step) * step; v <= s.from + s.span; v += step) {
      g.moveTo(s.x(v), base);
      g.lineTo(s.x(v), base + 5);
      const words = this.label(v, digits, place.unit);
      const half = g.measureText(words).width / 2;
      if (s.x(v) + half < s.left + s.inner + 8 && s.x(v) - half > s.left - 20) g.fillText(words, s.x(v), base + 6);
    }
    // The finest scale has a tick for each um, however narrow the screen is.
    const fine = k === SPANS.length - 1 ? MICRON : step;
    for (let n = Math.ceil(s.from / fine); fine < step && n * fine <= s.from + s.span; n++) {
      g.moveTo(s.x(n * fine), base);
      g.lineTo(s.x(n * fine), base + 3);
    }
    g.stroke();
    this.uncertain(g, s, place, base, clamp);
    if (k < 2) this.stages(g, s, place, base, clamp);
    if (Number.isFinite(place.target) && inside(place.target)) {
      g.strokeStyle = colours.two;
      g.lineWidth = 2;
      g.beginPath();
      g.moveTo(s.x(place.target), base - s.row * 0.36);
      g.lineTo(s.x(place.target), base + 5);
      g.stroke();
      g.lineWidth = 1;
    }
    this.proposal(g, s, base, inside);
    this.pointer(g, s, place, base, inside(place.position));
  }

  uncertain(g, s, place, base, clamp) {
    if (!Number.isFinite(place.uncertainty)) return;
    const half = place.uncertainty * 1e-3, a = clamp(place.position - half), b = clamp(place.position + half);
    g.fillStyle = colours.fill;
    g.fillRect(a, base - 6, Math.max(b - a, 1), 5);
  }

  // The carriage, and the micro-stage's contraction from it to where the whole stands.
  stages(g, s, place, base, clamp) {
    const a = clamp(place.macro), b = clamp(place.position);
    g.fillStyle = colours.one;
    g.fillRect(a - 3, base - 15, 6, 8);
    g.strokeStyle = colours.three;
    g.lineWidth = 3;
    g.beginPath();
    g.moveTo(a, base - 11);
    g.lineTo(b, base - 11);
    g.stroke();
    g.lineWidth = 1;
  }

  label(mm, digits, unit) {
    const less = Math.round(Math.log10(unit.scale / unit.factor));
    return (mm * unit.scale / unit.factor).toFixed(Math.max(digits - less, 0));
  }

  spoken(mm, unit) { return `${Number((mm * unit.scale / unit.factor).toPrecision(6))} ${unit.name}`; }

  // Where a click has proposed a target.
  proposal(g, s, base, inside) {
    if (!Number.isFinite(this.proposed) || !inside(this.proposed)) return;
    g.strokeStyle = colours.mark;
    g.setLineDash([3, 3]);
    g.beginPath();
    g.moveTo(s.x(this.proposed), base - s.row * 0.36);
    g.lineTo(s.x(this.proposed), base + 5);
    g.stroke();
    g.setLineDash([]);
  }

  // Full where the position is known and live, else hollow.
  pointer(g, s, place, base, inside) {
    const position = place.position;
    g.fillStyle = colours.ink;
    g.strokeStyle = colours.faint;
    g.beginPath();
    if (inside) {
      const x = s.x(position);
      g.moveTo(x, base - 1);
      g.lineTo(x - 5, base - 10);
      g.lineTo(x + 5, base - 10);
    } else {
      const right = position > s.from, x = right ? s.left + s.inner : s.left, d = right ? -1 : 1;
      g.moveTo(x, base - 6);
      g.lineTo(x + 8 * d, base - 11);
      g.lineTo(x + 8 * d, base - 1);
      const off = Math.abs(position - (s.from + s.span / 2));
      const words = `${Number((off * 1e-3 / place.unit.factor).toPrecision(3))} ${place.unit.name} off`;
      g.textAlign = right ? "right" : "left";
      g.textBaseline = "bottom";
      g.fillText(words, x + 12 * d, base - 2);
    }
    g.closePath();
    if (place.live) g.fill();
    else g.stroke();
  }
}
