// The life of a corner.

import { begin, minutes, tidy } from "./charts.js";
import { colour } from "./colours.js";

const SEEN = 1, MISSED = 0;

/** When a corner was seen (up) and missed (down), and f / (f + o) until then. */
export function drawLife(canvas, story, until, limit) {
  const area = begin(canvas);
  if (!area) return;
  const { ctx, width, height } = area, left = 28, right = width - 6, top = 6, bottom = height - 14;
  const n = story.times.filter((t) => t <= until + 1e-3).length;
  const t0 = n ? story.times[0] : 0, t1 = Math.max(until, t0 + 1);
  const x = (t) => left + (right - left) * (t - t0) / (t1 - t0), y = (v) => bottom - 22 - (bottom - 22 - top) * v;
  ctx.strokeStyle = colour("grid");
  ctx.fillStyle = colour("muted");
  ctx.textAlign = "right";
  for (const v of [0, 0.5, 1]) {
    ctx.beginPath();
    ctx.moveTo(left, y(v));
    ctx.lineTo(right, y(v));
    ctx.stroke();
    ctx.fillText(v, left - 4, y(v) + 3);
  }
  ctx.strokeStyle = colour("bad");
  ctx.setLineDash([3, 3]);
  ctx.beginPath();
  ctx.moveTo(left, y(limit));
  ctx.lineTo(right, y(limit));
  ctx.stroke();
  ctx.setLineDash([]);
  let seen = 0, missed = 0;
  const rate = new Path2D(), marks = { [SEEN]: new Path2D(), [MISSED]: new Path2D() };
  let begun = false;
  for (let i = 0; i < n; i++) {
    const what = story.what[i];
    if (what !== SEEN && what !== MISSED) continue;
    if (what === SEEN) seen += 1;
    else missed += 1;
    const px = x(story.times[i]), v = missed / (seen + missed);
    marks[what].rect(px, what === SEEN ? bottom - 18 : bottom - 9, 1.4, 8);
    if (begun) rate.lineTo(px, y(v));
    else rate.moveTo(px, y(v));
    begun = true;
  }
  ctx.fillStyle = colour("good");
  ctx.fill(marks[SEEN]);
  ctx.fillStyle = colour("bad");
  ctx.fill(marks[MISSED]);
  ctx.strokeStyle = colour("text");
  ctx.lineWidth = 1.5;
  ctx.stroke(rate);
  ctx.fillStyle = colour("muted");
  ctx.textAlign = "left";
  ctx.fillText(`${minutes(t0)}  f/(f+o), seen (green) and missed (red)`, left, height - 2);
  ctx.textAlign = "right";
  ctx.fillText(minutes(t1), right, height - 2);
}

/** Innovations of a corner: where it was seen, about where the map had it, cm. */
export function drawInnovations(canvas, story, until) {
  const area = begin(canvas);
  if (!area) return;
  const { ctx, width, height } = area, points = [];
  for (let i = 0; i < story.times.length; i++) {
    if (story.dx[i] !== null && story.times[i] <= until + 1e-3) points.push([100 * story.dx[i], 100 * story.dy[i]]);
  }
  const sizes = points.map(([dx, dy]) => Math.hypot(dx, dy)).sort((a, b) => a - b);
  const most = tidy(Math.max(1.1 * (sizes[Math.floor(0.97 * (sizes.length - 1))] || 1), 1));
  const scale = (height / 2 - 14) / most, cx = width / 2, cy = height / 2;
  ctx.strokeStyle = colour("grid");
  ctx.fillStyle = colour("muted");
  for (const part of [0.5, 1]) {
    ctx.beginPath();
    ctx.arc(cx, cy, part * most * scale, 0, 2 * Math.PI);
    ctx.stroke();
    ctx.fillText(`${Number((part * most).toPrecision(2))} cm`, cx + 4, cy - part * most * scale - 3);
  }
  ctx.beginPath();
  ctx.moveTo(cx - height / 2, cy);
  ctx.lineTo(cx + height / 2, cy);
  ctx.moveTo(cx, 0);
  ctx.lineTo(cx, height);
  ctx.stroke();
  ctx.fillStyle = colour("corner");
  points.forEach(([dx, dy], i) => {
    ctx.globalAlpha = 0.25 + 0.75 * (i + 1) / points.length;
    ctx.beginPath();
    ctx.arc(cx + scale * dx, cy - scale * dy, 2.4, 0, 2 * Math.PI);
    ctx.fill();
  });
  ctx.globalAlpha = 1;
  ctx.fillStyle = colour("muted");
  ctx.textAlign = "left";
  ctx.fillText(`${points.length} innovations`, 4, height - 4);
}
