// Columns of recordings over time, drawn by uPlot: one span of time for all panels.

"use strict";

(async () => {
  const HEIGHT = 210, DASHES = [[], [2, 3], [8, 3, 2, 3]];
  const $ = (id) => document.getElementById(id);
  const data = JSON.parse($("data").textContent);
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

  async function unpack(text, Kind) {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Kind(await new Response(stream).arrayBuffer());
  }

  try {
    for (const side of data.sides) {
      side.t = await unpack(side.t, Float64Array);
      for (const column of Object.values(side.columns)) {
        column.low = await unpack(column.low, Float32Array);
        column.high = column.high ? await unpack(column.high, Float32Array) : column.low;
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
  let span = [...whole], wanted = 0;

  // Columns of one recording as uPlot takes them: a point a row, or two of several rows.
  function points(side, names) {
    const columns = names.map((name) => side.columns[name]);
    const twice = columns.some((column) => column.high !== column.low);
    const spread = (low, high, middle) => Array.from({ length: (twice ? 2 : 1) * low.length }, (_, k) => {
      const value = twice ? (k % 2 ? high : low)[k >> 1] : low[k];
      return value === value ? value + middle : null;
    });
    return [spread(side.t, side.t, 0), ...columns.map(({ low, high, middle }) => spread(low, high, middle))];
  }

  function look(panel, name, k) {
    const reference = data.references.includes(name);
    const plain = panel.columns.filter((n) => !data.references.includes(n));
    const place = reference ? 5 : plain.indexOf(name) % 5;
    const alone = data.sides.length === 1;
    const dash = reference ? [6, 4] : DASHES[(alone ? 0 : place) % DASHES.length];
    return { colour: `c${alone ? place : k % 6}`, dash, width: !alone && k === 0 ? 2.5 : 1.4 };
  }

  const places = (step) => Math.min(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), 12);
  function written(value, step) {
    const extreme = Math.abs(value) >= 1e6 || (step < 1e-6 && Math.abs(value) < 1e-3);
    return extreme && value !== 0 ? value.toExponential(3) : value.toFixed(places(step));
  }

  // The row of a recording that is nearest to a time.
  function nearest(t, time) {
    let low = 0, high = t.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (t[middle] < time) low = middle; else high = middle;
    }
    return time - t[low] < t[high] - time ? low : high;
  }

  // What a line shows at the pointer.
  function reading({ side, column }, unit, time) {
    if (!(time >= side.t[0] && time <= side.t[side.t.length - 1])) return ": -";
    const k = nearest(side.t, time), low = column.low[k] + column.middle, high = column.high[k] + column.middle;
    const short = (v) => String(Number(v.toPrecision(7)));
    if (!(low <= high)) return ": -";
    return `: ${low === high ? short(low) : `${short(low)} to ${short(high)}`} ${unit}`.trimEnd();
  }

  const axis = {
    stroke: () => colour("faint"),
    grid: { stroke: () => colour("line"), width: 1 },
    ticks: { show: false },
    font: "11px system-ui, sans-serif",
    labelFont: "11px system-ui, sans-serif",
  };

  const plots = data.panels.map((panel) => {
    const box = document.createElement("section"), legend = document.createElement("div");
    box.className = "panel";
    legend.className = "legend";
    box.append(legend);
    $("panels").append(box);
    const lines = data.sides.flatMap((side, k) => panel.columns.map((name) => (
      { side, name, column: side.columns[name], ...look(panel, name, k) })));
    const plot = new uPlot({
      width: box.clientWidth,
      height: HEIGHT,
      legend: { show: false },
      scales: { x: { time: false, min: whole[0], max: whole[1] } },
      axes: [
        { ...axis, values: (_, ticks, a, b, step) => ticks.map((t) => `${written(t, step)} s`) },
        { ...axis, size: 64, label: panel.unit ? `[${panel.unit}]` : "", labelSize: panel.unit ? 14 : 0,
          values: (_, ticks, a, b, step) => ticks.map((v) => written(v, step)) },
      ],
      series: [{}, ...lines.map((line) => ({ stroke: () => colour(line.colour), dash: line.dash,
        width: line.width, points: { show: false } }))],
      cursor: {
        y: false,
        points: { show: false },
        sync: { key: "time" },
        drag: { x: true, y: false, setScale: false },
        bind: {
          dblclick: () => everything,
          mousedown: (u, _, begin) => (event) => (event.shiftKey ? pull(u, event) : begin(event)),
        },
      },
      hooks: {
        setSelect: [(u) => {
          if (u.select.width < 4) return;
          const [from, to] = [u.select.left, u.select.left + u.select.width].map((p) => u.posToVal(p, "x"));
          u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
          show(from, to);
        }],
        setCursor: [(u) => {
          const time = u.cursor.left >= 0 ? u.posToVal(u.cursor.left, "x") : NaN;
          for (const line of lines) {
            line.words.data = line.title + (time === time ? reading(line, panel.unit, time) : "");
          }
        }],
      },
    }, uPlot.join(data.sides.map((side) => points(side, panel.columns))), box);
    plot.root.setAttribute("role", "img");
    plot.root.setAttribute("aria-label", `${panel.columns.join(", ")} over time`);
    lines.forEach((line, k) => {
      const button = document.createElement("button"), key = document.createElement("i");
      key.style.borderColor = `var(--${line.colour})`;
      if (line.dash.length) key.style.borderTopStyle = "dashed";
      line.title = data.sides.length > 1 ? `${line.name}, ${line.side.label}` : line.name;
      line.words = document.createTextNode(line.title);
      button.type = "button";
      button.setAttribute("aria-pressed", "true");
      button.append(key, line.words);
      button.addEventListener("click", () => {
        const shown = button.getAttribute("aria-pressed") !== "true";
        button.setAttribute("aria-pressed", String(shown));
        plot.setSeries(k + 1, { show: shown });
      });
      legend.append(button);
    });
    plot.over.addEventListener("wheel", (event) => {
      if (!event.ctrlKey) return;
      event.preventDefault();
      const by = Math.min(Math.max(event.deltaY, -100), 100);
      zoom(Math.exp(by * 0.004), plot.posToVal(event.offsetX, "x"));
    }, { passive: false });
    return plot;
  });

  // With Shift the span follows the pointer.
  function pull(u, begun) {
    const [from, to] = span, width = u.over.clientWidth, ended = new AbortController();
    addEventListener("mousemove", (event) => {
      const by = ((begun.clientX - event.clientX) / width) * (to - from);
      show(from + by, to + by);
    }, { signal: ended.signal });
    addEventListener("mouseup", () => ended.abort(), { signal: ended.signal });
  }

  function draw() {
    wanted = 0;
    for (const plot of plots) plot.setScale("x", { min: span[0], max: span[1] });
    const digits = Math.min(places(span[1] - span[0]) + 4, 9);
    $("from").value = span[0].toFixed(digits);
    $("to").value = span[1].toFixed(digits);
  }

  function show(from, to) {
    const wide = Math.min(Math.max(to - from, least), whole[1] - whole[0]);
    const middle = (from + to) / 2;
    const start = Math.min(Math.max(middle - wide / 2, whole[0]), whole[1] - wide);
    span = [start, start + wide];
    wanted ||= requestAnimationFrame(draw);
  }
  function zoom(factor, at = (span[0] + span[1]) / 2) {
    show(at - (at - span[0]) * factor, at + (span[1] - at) * factor);
  }
  const slide = (share) => show(span[0] + share * (span[1] - span[0]), span[1] + share * (span[1] - span[0]));
  function everything() { show(...whole); }

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

  const fit = () => {
    for (const plot of plots) plot.setSize({ width: plot.root.parentElement.clientWidth, height: HEIGHT });
  };
  addEventListener("resize", fit);
  addEventListener("beforeprint", fit);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => plots.forEach((p) => p.redraw(false)));
  draw();
  document.body.dataset.ready = "yes";
})();
