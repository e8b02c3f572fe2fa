// The scan from above, and the detectors' response along its contours.

import { begin } from "./charts.js";
import { colour, contourColour, laneColour } from "./colours.js";

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
    for (let i = 0; i < lane.corners.length; i += 2) {
      const [x, y] = at(lane.corners[i], lane.corners[i + 1]);
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
  canvas.style.height = `${78 + 42 * frame.lanes.length}px`;
  const area = begin(canvas);
  if (!area) return;
  const { ctx, width, height } = area, left = 4, right = width - 4, rows = frame.lanes.length;
  const tall = (height - 18) / rows;
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
