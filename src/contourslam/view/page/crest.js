// The scan on a map, with the detector's response standing on it.

import { colour, contourColour } from "./colours.js";

/** The scan by contour; the detector's response stands on it as a crest, towards the lidar's side. */
export function drawScan(view, model, frame, response) {
  const { ctx, sx, sy } = view, { points, starts } = model.frame, at = view.lidar(model);
  for (let c = 0; c + 1 < starts.length; c++) {
    ctx.beginPath();
    for (let i = starts[c]; i < starts[c + 1]; i++) {
      const [x, y] = at(points[2 * i], points[2 * i + 1]);
      if (i === starts[c]) ctx.moveTo(sx(x), sy(y));
      else ctx.lineTo(sx(x), sy(y));
    }
    ctx.strokeStyle = contourColour(c);
    ctx.lineWidth = 3;
    ctx.stroke();
  }
  if (!response) return;
  const { curve, curve_starts: cs, response: r, candidates } = frame, crest = Math.max(5, Math.min(0.35 * view.camera.scale, 26)), high = crest / Math.max(frame.threshold, 1e-6);
  ctx.strokeStyle = colour("bad");
  ctx.lineWidth = 1.2;
  ctx.beginPath();
  for (let c = 0; c + 1 < cs.length; c++) {
    for (let i = cs[c]; i < cs[c + 1]; i++) {
      if (!(r[i] > 0.05 * frame.threshold)) continue;
      const a = Math.max(i - 1, cs[c]), b = Math.min(i + 1, cs[c + 1] - 1);
      const [x0, y0] = at(curve[2 * a], curve[2 * a + 1]), [x1, y1] = at(curve[2 * b], curve[2 * b + 1]);
      const [x, y] = at(curve[2 * i], curve[2 * i + 1]), length = Math.hypot(x1 - x0, y1 - y0) || 1;
      const up = Math.min(r[i] * high, 1.8 * crest), px = sx(x), py = sy(y);
      ctx.moveTo(px, py);
      ctx.lineTo(px - up * (y1 - y0) / length, py - up * (x1 - x0) / length);
    }
  }
  ctx.stroke();
  ctx.lineWidth = 1.5;
  const mark = Math.max(2, Math.min(0.08 * view.camera.scale, 4));
  for (const i of candidates) {
    const [x, y] = at(curve[2 * i], curve[2 * i + 1]);
    ctx.strokeRect(sx(x) - mark, sy(y) - mark, 2 * mark, 2 * mark);
  }
}
