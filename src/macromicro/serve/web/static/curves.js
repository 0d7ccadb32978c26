// Curves over time in the page's colours, drawn by uPlot.

import { colours, decimals } from "./canvas.js";

const LEFT = 46, RIGHT = 18; // of the curves: numbers, and half of the last time's words
const FONT = "11px system-ui, sans-serif";
// All axes are drawn in the same way; the words at their ticks have the digits of their step.
const axis = (size, space, suffix = "") => ({
  size, space, font: FONT, gap: 4, stroke: () => colours.faint, grid: { stroke: () => colours.line, width: 1 },
  ticks: { show: false }, values: (_, ticks, a, b, step) => ticks.map((v) => (v || 0).toFixed(decimals(step)) + suffix),
});

export class Curves {
  // A colour's name of each line. `range`: of values shown; without it, of all. `marks`: times to mark.
  constructor(figure, label, lines, { range = undefined, marks = () => [] } = {}) {
    this.figure = figure;
    this.plot = new uPlot({
      ...this.size,
      legend: { show: false },
      cursor: { show: false },
      padding: [6, RIGHT, 0, 0],
      scales: { x: { time: false }, y: { range } },
      axes: [axis(18, 90, " s"), axis(LEFT, 22)],
      series: [{}, ...lines.map((name) => ({ stroke: () => colours[name], width: 1.5, points: { show: false } }))],
      hooks: { drawAxes: [(u) => this.mark(u, marks())] },
    }, [[], ...lines.map(() => [])], figure);
    this.plot.root.setAttribute("role", "img");
    this.plot.root.setAttribute("aria-label", label);
    this.watch = new ResizeObserver(() => this.fit());
    this.watch.observe(figure);
  }

  get size() { return { width: Math.max(this.figure.clientWidth, 80), height: 102 }; }
  get width() { return this.figure.clientWidth - LEFT - RIGHT; } // of the curves alone

  remove() {
    this.watch.disconnect();
    this.plot.destroy();
  }

  // Follows its figure's width, and draws what came while that was not shown.
  fit() {
    if (!this.figure.clientWidth) return;
    if (this.plot.width !== this.size.width) this.plot.setSize(this.size);
    if (this.late) this.show();
  }

  // Values of each line at the times, shown over a span of time.
  draw(times, values, from, to) {
    this.late = [times, values, from, to];
    if (this.figure.clientWidth) this.show();
  }

  show() {
    const [times, values, from, to] = this.late;
    this.late = null;
    this.plot.batch(() => {
      this.plot.setData([times, ...values], false);
      this.plot.setScale("x", { min: from, max: to });
    });
  }

  mark(u, times) {
    const { ctx: g, bbox } = u;
    g.save();
    g.strokeStyle = colours.mark;
    g.lineWidth = devicePixelRatio;
    g.setLineDash([3 * devicePixelRatio, 3 * devicePixelRatio]);
    g.beginPath();
    for (const time of times) {
      if (time < u.scales.x.min || time > u.scales.x.max) continue;
      const x = u.valToPos(time, "x", true);
      g.moveTo(x, bbox.top);
      g.lineTo(x, bbox.top + bbox.height);
    }
    g.stroke();
    g.restore();
  }
}
