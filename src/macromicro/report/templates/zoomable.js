// Columns of recordings over time: one span of time for all panels, drawn anew at each change.

"use strict";

(async () => {
  const LEFT = 64, BOTTOM = 20, TOP = 6, RIGHT = 8, DASHES = [[], [2, 3], [8, 3, 2, 3]];
  const $ = (id) => document.getElementById(id);
  const data = JSON.parse($("data").textContent);
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

  async function unpacked(text, Kind) {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Kind(await new Response(stream).arrayBuffer());
  }

  try {
    for (const side of data.sides) {
      side.t = await unpacked(side.t, Float64Array);
      for (const column of Object.values(side.columns)) {
        column.low = await unpacked(column.low, Float32Array);
        column.high = column.high ? await unpacked(column.high, Float32Array) : column.low;
      }
    }
  } catch (error) {
    $("fault").textContent = `This browser cannot show the page: ${error.message}. One of 2023 or later can.`;
    return;
  }

  const filled = data.sides.filter((side) => side.t.length);
  const first = Math.min(...filled.map((side) => side.t[0]));
  const last = Math.max(...filled.map((side) => side.t[side.t.length - 1]));
  if (!(last >= first)) { $("fault").textContent = "There are no rows."; return; }
  const whole = [first, last > first ? last : first + 1e-9];
  const gaps = filled.filter((side) => side.t.length > 1).map((side) => side.t[1] - side.t[0]);
  const least = Math.min(whole[1] - whole[0], 4 * Math.min(Infinity, ...gaps));
  let span = [...whole], pointer = NaN, pull = null;

  // The first row at or after a time.
  function after(t, time) {
    let low = 0, high = t.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (t[middle] < time) low = middle + 1; else high = middle;
    }
    return low;
  }

  function look(panel, name, k) {
    const reference = data.references.includes(name);
    const plain = panel.columns.filter((n) => !data.references.includes(n));
    const place = reference ? 5 : plain.indexOf(name) % 5;
    const alone = data.sides.length === 1;
    const dash = reference ? [6, 4] : DASHES[(alone ? 0 : place) % DASHES.length];
    return { colour: `c${alone ? place : k % 6}`, dash, width: !alone && k === 0 ? 2.5 : 1.4 };
  }

  const panels = data.panels.map((panel) => {
    const box = document.createElement("section"), legend = document.createElement("div");
    const canvas = document.createElement("canvas");
    box.className = "panel";
    legend.className = "legend";
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `${panel.columns.join(", ")} over time`);
    const lines = [];
    data.sides.forEach((side, k) => {
      for (const name of panel.columns) {
        const line = { side, name, column: side.columns[name], shown: true, ...look(panel, name, k) };
        const button = document.createElement("button"), key = document.createElement("i");
        key.style.borderColor = `var(--${line.colour})`;
        if (line.dash.length) key.style.borderTopStyle = "dashed";
        line.title = data.sides.length > 1 ? `${name}, ${side.label}` : name;
        line.words = document.createTextNode(line.title);
        button.type = "button";
        button.setAttribute("aria-pressed", "true");
        button.append(key, line.words);
        button.addEventListener("click", () => {
          line.shown = !line.shown;
          button.setAttribute("aria-pressed", String(line.shown));
          draw();
        });
        legend.append(button);
        lines.push(line);
      }
    });
    box.append(legend, canvas);
    $("panels").append(box);
    return { ...panel, canvas, lines };
  });

  function nice(range, count) {
    const raw = range / Math.max(count, 1), power = 10 ** Math.floor(Math.log10(raw)), m = raw / power;
    return (m < 1.5 ? 1 : m < 3.5 ? 2 : m < 7.5 ? 5 : 10) * power;
  }
  const places = (step) => Math.min(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), 12);
  function written(value, step) {
    const big = Math.abs(value) >= 1e6 || (step < 1e-6 && Math.abs(value) < 1e-3);
    return big && value !== 0 ? value.toExponential(3) : value.toFixed(places(step));
  }

  // Rows that are seen, and one on either side, so that lines reach the edges.
  function seen(side) {
    return [Math.max(after(side.t, span[0]) - 1, 0), Math.min(after(side.t, span[1]) + 1, side.t.length)];
  }

  function range(panel) {
    let low = Infinity, high = -Infinity;
    for (const { side, column, shown } of panel.lines) {
      if (!shown) continue;
      const [from, to] = seen(side), middle = column.middle;
      for (let k = from; k < to; k++) {
        if (column.low[k] + middle < low) low = column.low[k] + middle;
        if (column.high[k] + middle > high) high = column.high[k] + middle;
      }
    }
    if (!(low <= high)) return [0, 1];
    const pad = 0.06 * (high - low) || 0.05 * Math.abs(high) || 0.5;
    return [low - pad, high + pad];
  }

  function trace(g, line, x, y) {
    const { side, column } = line, [from, to] = seen(side), { low, high, middle } = column;
    g.strokeStyle = colour(line.colour);
    g.setLineDash(line.dash);
    g.lineWidth = line.width;
    g.beginPath();
    let pen = NaN, k = from;
    while (k < to) {
      // All rows of one pixel are one stroke from their least to their greatest value.
      const pixel = Math.floor(x(side.t[k]));
      let a = Infinity, b = -Infinity;
      const start = k;
      do {
        if (low[k] < a) a = low[k];
        if (high[k] > b) b = high[k];
        k++;
      } while (k < to && Math.floor(x(side.t[k])) === pixel);
      if (!(a <= b)) { pen = NaN; continue; }
      const px = x(side.t[start]), down = pen - a > b - pen;
      const one = down ? b : a, two = down ? a : b;
      if (pen === pen) g.lineTo(px, y(one + middle)); else g.moveTo(px, y(one + middle) - 0.01);
      g.lineTo(px, y(two + middle));
      pen = two;
    }
    g.stroke();
    g.setLineDash([]);
  }

  function draw() {
    const step = span[1] - span[0];
    for (const panel of panels) {
      const { canvas } = panel, ratio = window.devicePixelRatio || 1;
      const width = canvas.clientWidth, height = canvas.clientHeight;
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
      const g = canvas.getContext("2d"), inner = width - LEFT - RIGHT, bottom = height - BOTTOM;
      if (inner < 20) continue;
      g.setTransform(ratio, 0, 0, ratio, 0, 0);
      g.font = "11px system-ui, sans-serif";
      const [low, high] = range(panel);
      panel.range = [low, high];
      const x = (t) => LEFT + ((t - span[0]) / step) * inner;
      const y = (v) => bottom - ((v - low) / (high - low)) * (bottom - TOP);
      g.strokeStyle = colour("line");
      g.fillStyle = colour("faint");
      g.beginPath();
      const rise = nice(high - low, 5), pace = nice(step, inner / 90);
      g.textAlign = "right";
      g.textBaseline = "middle";
      for (let k = Math.ceil(low / rise); k * rise <= high; k++) {
        g.moveTo(LEFT, y(k * rise));
        g.lineTo(width - RIGHT, y(k * rise));
        g.fillText(written(k * rise, rise), LEFT - 5, y(k * rise));
      }
      g.textAlign = "center";
      g.textBaseline = "top";
      for (let k = Math.ceil(span[0] / pace); k * pace <= span[1]; k++) {
        g.moveTo(x(k * pace), TOP);
        g.lineTo(x(k * pace), bottom);
        if (x(k * pace) < width - 25) g.fillText(`${written(k * pace, pace)} s`, x(k * pace), bottom + 4);
      }
      g.stroke();
      if (panel.unit) {
        g.save();
        g.translate(9, (TOP + bottom) / 2);
        g.rotate(-Math.PI / 2);
        g.textBaseline = "middle";
        g.fillText(`[${panel.unit}]`, 0, 0);
        g.restore();
      }
      g.save();
      g.beginPath();
      g.rect(LEFT, TOP, inner, bottom - TOP);
      g.clip();
      for (const line of panel.lines) if (line.shown) trace(g, line, x, y);
      if (pull && !pull.moves) {
        g.globalAlpha = 0.2;
        g.fillStyle = colour("c0");
        g.fillRect(x(Math.min(pull.from, pull.to)), TOP, Math.abs(x(pull.to) - x(pull.from)), bottom - TOP);
        g.globalAlpha = 1;
      }
      if (pointer === pointer) {
        g.strokeStyle = colour("faint");
        g.lineWidth = 1;
        g.beginPath();
        g.moveTo(x(pointer), TOP);
        g.lineTo(x(pointer), bottom);
        g.stroke();
      }
      g.restore();
      for (const line of panel.lines) line.words.data = line.title + reading(line, panel.unit);
    }
    const digits = Math.min(places(step) + 4, 9);
    $("from").value = span[0].toFixed(digits);
    $("to").value = span[1].toFixed(digits);
  }

  // What a line shows at the pointer.
  function reading({ side, column }, unit) {
    if (pointer !== pointer) return "";
    let k = Math.min(after(side.t, pointer), side.t.length - 1);
    if (k > 0 && pointer - side.t[k - 1] < side.t[k] - pointer) k--;
    const low = column.low[k] + column.middle, high = column.high[k] + column.middle;
    if (!(low <= high) || pointer < side.t[0] || pointer > side.t[side.t.length - 1]) return ": -";
    const short = (v) => String(Number(v.toPrecision(7)));
    return `: ${low === high ? short(low) : `${short(low)} to ${short(high)}`} ${unit}`.trimEnd();
  }

  let asked = 0;
  const soon = () => { asked ||= requestAnimationFrame(() => { asked = 0; draw(); }); };

  function show(from, to) {
    const wide = Math.min(Math.max(to - from, least), whole[1] - whole[0]);
    const middle = (from + to) / 2;
    const start = Math.min(Math.max(middle - wide / 2, whole[0]), whole[1] - wide);
    span = [start, start + wide];
    soon();
  }
  function zoom(factor, at = (span[0] + span[1]) / 2) {
    show(at - (at - span[0]) * factor, at + (span[1] - at) * factor);
  }
  const slide = (share) => show(span[0] + share * (span[1] - span[0]), span[1] + share * (span[1] - span[0]));
  const everything = () => show(...whole);

  $("in").addEventListener("click", () => zoom(0.5));
  $("out").addEventListener("click", () => zoom(2));
  $("left").addEventListener("click", () => slide(-0.5));
  $("right").addEventListener("click", () => slide(0.5));
  $("all").addEventListener("click", everything);
  $("span").addEventListener("submit", (event) => {
    event.preventDefault();
    const from = Number.parseFloat($("from").value), to = Number.parseFloat($("to").value);
    const good = Number.isFinite(from) && Number.isFinite(to) && from < to;
    $("fault").textContent = good ? "" : "Accepted are two numbers in s, the second after the first.";
    if (good) show(from, to);
  });

  for (const { canvas } of panels) {
    const inner = () => canvas.clientWidth - LEFT - RIGHT;
    const time = (event) => {
      const share = (event.clientX - canvas.getBoundingClientRect().left - LEFT) / inner();
      return span[0] + Math.min(Math.max(share, 0), 1) * (span[1] - span[0]);
    };
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      canvas.setPointerCapture(event.pointerId);
      const at = time(event);
      pull = { from: at, to: at, x: event.clientX, span: [...span], moves: event.shiftKey };
    });
    canvas.addEventListener("pointermove", (event) => {
      pointer = time(event);
      if (pull && pull.moves) {
        const by = ((pull.x - event.clientX) / inner()) * (pull.span[1] - pull.span[0]);
        show(pull.span[0] + by, pull.span[1] + by);
      } else if (pull) pull.to = pointer;
      soon();
    });
    canvas.addEventListener("pointerup", (event) => {
      const done = pull;
      pull = null;
      if (done && !done.moves && Math.abs(event.clientX - done.x) > 4) {
        show(Math.min(done.from, done.to), Math.max(done.from, done.to));
      }
      soon();
    });
    canvas.addEventListener("pointercancel", () => { pull = null; soon(); });
    canvas.addEventListener("pointerleave", () => { pointer = NaN; soon(); });
    canvas.addEventListener("dblclick", everything);
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey) return;
      event.preventDefault();
      zoom(Math.exp(Math.min(Math.max(event.deltaY, -100), 100) * 0.004), time(event));
    }, { passive: false });
  }
  addEventListener("resize", soon);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", soon);
  addEventListener("beforeprint", draw);
  draw();
  document.body.dataset.ready = "yes";
})();
