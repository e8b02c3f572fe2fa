// Small charts on a canvas: lines over time, the scan from above, the response along the contours, a corner's life.

import { colour, contourColour, laneColour } from "./colours.js";

/** Prepare a canvas; gives its context and size, or null where it is not to be seen. */
function begin(canvas) {
  const ratio = Math.min(devicePixelRatio || 1, 2), width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width || !height) return null;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const ctx = canvas.getContext("2d");
  ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
  ctx.clearRect(0, 0, width, height);
  ctx.font = "10px system-ui";
  ctx.lineJoin = "round";
  return { ctx, width, height };
}

export const minutes = (seconds) => {
  const s = Math.max(0, Math.floor(seconds)), h = Math.floor(s / 3600);
  const mm = Math.floor(s / 60) % 60, ss = String(s % 60).padStart(2, "0");
  return h ? `${h}:${String(mm).padStart(2, "0")}:${ss}` : `${mm}:${ss}`;
};

/** A tidy greatest value: 1, 2 or 5 times a power of ten. */
function tidy(value) {
  const ten = 10 ** Math.floor(Math.log10(Math.max(value, 1e-9)));
  return [1, 2, 5, 10].find((m) => m * ten >= value) * ten;
}

/** Lines over time, one a lane; `band` is shaded, `log` counts by powers of ten. */
export function drawSeries(canvas, times, lines, { band = null, log = null, factor = 1 } = {}) {
  const area = begin(canvas);
  if (!area) return;
  const { ctx, width, height } = area, left = 30, bottom = height - 14, top = 6, right = width - 4;
  const n = times.length, t0 = n ? times[0] : 0, t1 = n ? Math.max(times[n - 1], t0 + 1) : 1;
  let most = 0;
  if (!log) {
    const all = [];
    for (const line of lines) for (let i = 0; i < n; i += Math.ceil(n / 400)) if (line[i] >= 0) all.push(line[i] * factor);
    all.sort((a, b) => a - b);
    most = tidy(1.05 * (all[Math.floor(0.985 * (all.length - 1))] || 1));
  }
  const x = (t) => left + (right - left) * (t - t0) / (t1 - t0);
  const y = log
    ? (v) => bottom - (bottom - top) * (Math.log10(Math.max(v, log[0])) - Math.log10(log[0])) / Math.log10(log[1] / log[0])
    : (v) => bottom - (bottom - top) * Math.min(v * factor / most, 1.05);
  if (band) {
    ctx.fillStyle = colour("good");
    ctx.globalAlpha = 0.13;
    ctx.fillRect(left, y(band[1]), right - left, y(band[0]) - y(band[1]));
    ctx.globalAlpha = 1;
  }
  ctx.strokeStyle = colour("grid");
  ctx.fillStyle = colour("muted");
  ctx.lineWidth = 1;
  ctx.textAlign = "right";
  const ticks = log ? [0.01, 0.1, 1, 10, 100].filter((v) => v >= log[0] && v <= log[1]) : [0, most / 2, most];
  for (const tick of ticks) {
    const at = Math.round(y(log ? tick : tick / factor)) + 0.5;
    ctx.beginPath();
    ctx.moveTo(left, at);
    ctx.lineTo(right, at);
    ctx.stroke();
    ctx.fillText(Number(tick.toPrecision(2)), left - 4, Math.min(at + 3, bottom));
  }
  ctx.textAlign = "left";
  ctx.fillText(minutes(t0), left, height - 2);
  ctx.textAlign = "right";
  ctx.fillText(minutes(t1), right, height - 2);
  lines.forEach((line, lane) => {
    ctx.strokeStyle = laneColour(lane);
    ctx.lineWidth = 1.3;
    ctx.beginPath();
    let open = false, pixel = -1, low = 0, high = 0;
    for (let i = 0; i < n; i++) {
      const v = line[i];
      if (!(v >= 0)) { continue; }
      const px = x(times[i]), py = Math.max(top - 2, y(v));
      if (open && Math.floor(px) === pixel) { // many points in one column: only its extent
        if (py < low) { low = py; ctx.lineTo(px, py); }
        if (py > high) { high = py; ctx.lineTo(px, py); }
        continue;
      }
      pixel = Math.floor(px);
      low = high = py;
      if (open) ctx.lineTo(px, py);
      else ctx.moveTo(px, py);
      open = true;
    }
    ctx.stroke();
  });
}

/** Running mean over `width` values; what is missing stays missing. */
export function smooth(values, width) {
  const out = new Float32Array(values.length);
  let sum = 0, count = 0;
  for (let i = 0; i < values.length; i++) {
    if (values[i] >= 0) { sum += values[i]; count += 1; }
    const gone = i - width;
    if (gone >= 0 && values[gone] >= 0) { sum -= values[gone]; count -= 1; }
    out[i] = count ? sum / count : NaN;
  }
  return out;
}

/** The scan in the robot's frame, ahead is up. */
export function drawScan(canvas, frame, mount) {
  const area = begin(canvas);
  if (!area) return;
  const { ctx, width, height } = area, { points, starts } = frame;
  const c = Math.cos(mount[2]), s = Math.sin(mount[2]);
  const at = (x, y) => [mount[0] + c * x - s * y, mount[1] + s * x + c * y];
  let x0 = -1, x1 = 1, y0 = -1, y1 = 1;
  const far = [];
  for (let i = 0; i < points.length; i += 2) far.push(Math.hypot(points[i], points[i + 1]));
  far.sort((a, b) => a - b);
  const limit = 1.3 * (far[Math.floor(0.9 * (far.length - 1))] || 4);
  for (let i = 0; i < points.length; i += 2) {
    const [x, y] = at(points[i], points[i + 1]);
    if (Math.hypot(x, y) > limit) continue;
    x0 = Math.min(x0, x); x1 = Math.max(x1, x); y0 = Math.min(y0, y); y1 = Math.max(y1, y);
  }
  const scale = Math.min((width - 16) / (y1 - y0), (height - 16) / (x1 - x0));
  const mx = (x0 + x1) / 2, my = (y0 + y1) / 2;
  const px = (y) => width / 2 - (y - my) * scale, py = (x) => height / 2 - (x - mx) * scale;
  ctx.strokeStyle = colour("grid");
  ctx.fillStyle = colour("muted");
  ctx.textAlign = "left";
  const ring = [0.5, 1, 2, 5, 10, 20].find((r) => r * scale > 34) || 20;
  for (let r = ring; r * scale < 1.2 * Math.max(width, height); r += ring) {
    ctx.beginPath();
    ctx.arc(px(0), py(0), r * scale, 0, 2 * Math.PI);
    ctx.stroke();
  }
  ctx.fillText(`${ring} m a ring`, 4, height - 4);
  for (let k = 0; k + 1 < starts.length; k++) {
    ctx.strokeStyle = contourColour(k);
    ctx.lineWidth = 2;
    ctx.beginPath();
    for (let i = starts[k]; i < starts[k + 1]; i++) {
      const [x, y] = at(points[2 * i], points[2 * i + 1]);
      if (i === starts[k]) ctx.moveTo(px(y), py(x));
      else ctx.lineTo(px(y), py(x));
    }
    ctx.stroke();
  }
  frame.lanes.forEach((lane, number) => {
    ctx.strokeStyle = laneColour(number);
    ctx.lineWidth = 1.6;
    for (let i = 0; i < lane.cornerPoints.length; i += 2) {
      const [x, y] = at(lane.cornerPoints[i], lane.cornerPoints[i + 1]);
      ctx.beginPath();
      ctx.arc(px(y), py(x), 5 + 2.5 * number, 0, 2 * Math.PI);
      ctx.stroke();
    }
  });
  ctx.fillStyle = colour("robot");
  ctx.beginPath();
  ctx.moveTo(px(0), py(0) - 9);
  ctx.lineTo(px(0) + 6, py(0) + 6);
  ctx.lineTo(px(0) - 6, py(0) + 6);
  ctx.fill();
}

/** Response of each detector along the contours, in units of its threshold. */
export function drawResponse(canvas, frame) {
  const area = begin(canvas);
  if (!area) return;
  const { ctx, width, height } = area, left = 4, right = width - 4, rows = frame.lanes.length;
  const tall = (height - 14) / rows;
  frame.lanes.forEach((lane, number) => {
    const { response, curve_starts: starts, candidates, threshold } = lane, n = Math.max(response.length, 2);
    const base = 2 + tall * (number + 1) - 3, high = (tall - 6) / 2.6;
    const x = (i) => left + (right - left) * i / (n - 1);
    const y = (v) => base - high * Math.min(v / threshold, 2.6);
    ctx.fillStyle = colour("grid");
    for (let c = 0; c + 1 < starts.length; c++) {
      ctx.fillStyle = contourColour(c);
      ctx.fillRect(x(starts[c]), base, Math.max(x(starts[c + 1] - 1) - x(starts[c]), 1), 3);
    }
    ctx.strokeStyle = colour("muted");
    ctx.lineWidth = 1;
    ctx.setLineDash([3, 3]);
    ctx.beginPath();
    ctx.moveTo(left, y(threshold));
    ctx.lineTo(right, y(threshold));
    ctx.stroke();
    ctx.setLineDash([]);
    ctx.strokeStyle = laneColour(number);
    ctx.lineWidth = 1.3;
    ctx.beginPath();
    for (let c = 0; c + 1 < starts.length; c++) {
      for (let i = starts[c]; i < starts[c + 1]; i++) {
        if (i === starts[c]) ctx.moveTo(x(i), y(response[i]));
        else ctx.lineTo(x(i), y(response[i]));
      }
    }
    ctx.stroke();
    ctx.fillStyle = laneColour(number);
    for (const i of candidates) {
      ctx.beginPath();
      ctx.arc(x(i), y(response[i]), 2.6, 0, 2 * Math.PI);
      ctx.fill();
    }
  });
  ctx.fillStyle = colour("muted");
  ctx.textAlign = "left";
  ctx.fillText("response along the contours; dashed: threshold", left, height - 2);
}

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
  const scale = (height / 2 - 12) / most, cx = width / 2, cy = height / 2;
  ctx.strokeStyle = colour("grid");
  ctx.fillStyle = colour("muted");
  for (const part of [0.5, 1]) {
    ctx.beginPath();
    ctx.arc(cx, cy, part * most * scale, 0, 2 * Math.PI);
    ctx.stroke();
    ctx.fillText(`${Number((part * most).toPrecision(2))} cm`, cx + part * most * scale + 3, cy - 3);
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
