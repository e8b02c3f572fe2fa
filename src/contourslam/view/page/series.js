// Lines over time.

import { begin, minutes, tidy } from "./charts.js";
import { colour, laneColour } from "./colours.js";

/** Lines over time, one a lane; `band`, a lower and an upper line, is shaded; `log` counts by powers of ten. */
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
    const known = Array.from(times.keys()).filter((i) => i % Math.ceil(n / 400) === 0 && band[0][i] >= 0);
    ctx.beginPath();
    for (const i of known) ctx.lineTo(x(times[i]), y(band[1][i]));
    for (const i of known.reverse()) ctx.lineTo(x(times[i]), y(band[0][i]));
    ctx.fill();
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

/** NIS by degrees of freedom of the last `width` knots together, and how many degrees that are. */
export function together(nis, dof, width) {
  const n = nis.length, ratio = new Float32Array(n), degrees = new Float32Array(n);
  let sum = 0, count = 0;
  for (let i = 0; i < n; i++) {
    if (dof[i] > 0) { sum += nis[i] * dof[i]; count += dof[i]; }
    const gone = i - width;
    if (gone >= 0 && dof[gone] > 0) { sum -= nis[gone] * dof[gone]; count -= dof[gone]; }
    ratio[i] = count ? sum / count : NaN;
    degrees[i] = count;
  }
  return { ratio, dof: degrees };
}

/** The band that holds 95 % of an honest filter's, at each knot for the lane with the fewest degrees of freedom. */
export function honest(degrees) {
  const least = degrees[0].map((_, i) => Math.min(...degrees.map((of) => of[i] || Infinity)));
  return [-1, 1].map((sign) => least.map((dof) => (dof < Infinity ? quantile(dof, sign * 1.96) : NaN)));
}

/** Of chi square by its degrees of freedom, `z` standard deviations off: Wilson and Hilferty, 1931. */
function quantile(dof, z) {
  const variance = 2 / (9 * dof);
  return Math.max(1 - variance + z * Math.sqrt(variance), 0) ** 3;
}
