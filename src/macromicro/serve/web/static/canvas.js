// Drawing surfaces in CSS pixels, and the page's colours.

const dark = matchMedia("(prefers-color-scheme: dark)");
export const colours = {};

function read() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["ink", "faint", "paper", "line", "box", "one", "two", "three", "mark", "fill", "bad"]) {
    colours[name] = style.getPropertyValue(`--${name}`).trim();
  }
}
read();
dark.addEventListener("change", read);

// The context of a canvas, cleared and scaled to CSS pixels, with its size.
export function surface(canvas) {
  const scale = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  const w = Math.round(width * scale), h = Math.round(height * scale);
  if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
  const g = canvas.getContext("2d");
  g.setTransform(scale, 0, 0, scale, 0, 0);
  g.clearRect(0, 0, width, height);
  g.font = "11px system-ui, sans-serif";
  g.lineWidth = 1;
  return { g, width, height };
}

// A step of 1, 2 or 5 times a power of ten, so that about `count` fit into `range`.
export function niceStep(range, count) {
  const raw = range / count, power = 10 ** Math.floor(Math.log10(raw));
  const m = raw / power;
  return (m < 1.5 ? 1 : m < 3.5 ? 2 : m < 7.5 ? 5 : 10) * power;
}

export function decimals(step) { return Math.max(0, -Math.floor(Math.log10(step) + 1e-9)); }
