// The Preisach plane: relays that are up, and the staircase L(t) between them and the others.

import { colours, niceStep, surface } from "./canvas.js";

const LEFT = 34, BOTTOM = 30, TOP = 6, RIGHT = 8;

export function drawPlane(canvas, plane) {
  const { g, width, height } = surface(canvas);
  const side = Math.min(width - LEFT - RIGHT, height - BOTTOM - TOP);
  if (side < 40) return;
  const { low, high, u, corners } = plane, scale = side / (high - low);
  const x = (v) => LEFT + (v - low) * scale, y = (v) => TOP + side - (v - low) * scale;
  const stairs = [];
  let beta = low;
  for (const [top, bottom] of corners) {
    stairs.push([beta, top], [bottom, top]);
    beta = bottom;
  }
  // Smaller reversals are left out: the last link goes straight to the present input.
  stairs.push([beta, u], [u, u]);
  g.fillStyle = colours.box;
  shape(g, [[low, low], [high, high], [low, high]], x, y);
  g.fill();
  g.fillStyle = colours.fill;
  shape(g, [...stairs, [low, low]], x, y);
  g.fill();
  g.strokeStyle = colours.faint;
  shape(g, [[low, low], [high, high], [low, high]], x, y);
  g.closePath();
  g.stroke();
  g.strokeStyle = colours.one;
  g.lineWidth = 2;
  shape(g, stairs, x, y);
  g.stroke();
  g.fillStyle = colours.two;
  g.beginPath();
  g.arc(x(u), y(u), 4, 0, 7);
  g.fill();
  g.fillStyle = colours.faint;
  g.textBaseline = "top";
  g.textAlign = "center";
  const step = niceStep(high - low, 5);
  for (let v = Math.ceil(low / step) * step; v <= high; v += step) {
    g.fillText(v.toFixed(0), x(v), TOP + side + 3);
  }
  g.fillText("down threshold [degC]", LEFT + side / 2, TOP + side + 16);
  g.textAlign = "right";
  g.textBaseline = "middle";
  for (let v = Math.ceil(low / step) * step; v <= high; v += step) {
    g.fillText(v.toFixed(0), LEFT - 4, y(v));
  }
  g.fillText("up threshold", LEFT + side, TOP + side * 0.86);
  g.fillText("(left scale) [degC]", LEFT + side, TOP + side * 0.93);
}

function shape(g, points, x, y) {
  g.beginPath();
  points.forEach(([beta, alpha], k) => {
    if (k) g.lineTo(x(beta), y(alpha)); else g.moveTo(x(beta), y(alpha));
  });
}
