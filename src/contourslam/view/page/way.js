// Where the robot is and was, on a map: ways, loops, its pose with the uncertainty, and how long a metre is.

import { colour, laneColour } from "./colours.js";

const SIGMAS = 3;
const FLASH = 1600; // ms

export function drawLine(view, points, style, width, dash = []) {
  const { ctx, sx, sy } = view;
  ctx.beginPath();
  let open = false;
  for (let i = 0; i < points.length; i += 2) {
    if (Number.isNaN(points[i])) { open = false; continue; }
    if (open) ctx.lineTo(sx(points[i]), sy(points[i + 1]));
    else ctx.moveTo(sx(points[i]), sy(points[i + 1]));
    open = true;
  }
  ctx.strokeStyle = style;
  ctx.lineWidth = width;
  ctx.setLineDash(dash);
  ctx.stroke();
  ctx.setLineDash([]);
}

export function drawPath(view, model, frame) {
  const n = model.shown, points = new Float32Array(2 * n + 2), pose = [0, 0, 0];
  for (let k = 0; k < n; k++) {
    model.pose(view.lane, k, pose);
    points[2 * k] = pose[0];
    points[2 * k + 1] = pose[1];
  }
  points[2 * n] = frame.pose[0];
  points[2 * n + 1] = frame.pose[1];
  drawLine(view, points, laneColour(view.lane), 1.6);
}

export function drawLoops(view, map) {
  const { ctx, sx, sy } = view, styles = [[0.16, 1], [0.9, 2], [0.9, 2]];
  ctx.strokeStyle = colour("loop");
  for (let i = 0; i < map.loop_methods.length; i++) {
    [ctx.globalAlpha, ctx.lineWidth] = styles[map.loop_methods[i]];
    ctx.beginPath();
    ctx.moveTo(sx(map.loops[4 * i]), sy(map.loops[4 * i + 1]));
    ctx.lineTo(sx(map.loops[4 * i + 2]), sy(map.loops[4 * i + 3]));
    ctx.stroke();
  }
  ctx.globalAlpha = 1;
}

export function drawRobot(view, frame) {
  const { ctx, sx, sy, camera } = view, [x, y, a] = frame.pose, px = sx(x), py = sy(y);
  const [xx, xy, yy, , , tt] = frame.covariance, middle = (xx + yy) / 2, half = Math.hypot((xx - yy) / 2, xy);
  const style = laneColour(view.lane), k = SIGMAS * camera.scale;
  const spread = Math.min(SIGMAS * Math.sqrt(Math.max(tt, 0)), Math.PI);
  ctx.fillStyle = ctx.strokeStyle = style;
  ctx.globalAlpha = 0.22;
  ctx.beginPath();
  ctx.ellipse(px, py, k * Math.sqrt(Math.max(middle + half, 0)), k * Math.sqrt(Math.max(middle - half, 0)),
    -0.5 * Math.atan2(2 * xy, xx - yy), 0, 2 * Math.PI);
  ctx.fill();
  ctx.beginPath();
  ctx.moveTo(px, py);
  ctx.arc(px, py, 46, -a - spread, -a + spread);
  ctx.fill();
  ctx.globalAlpha = 1;
  const size = Math.max(9, Math.min(0.32 * camera.scale, 22));
  ctx.save();
  ctx.translate(px, py);
  ctx.rotate(-a);
  ctx.beginPath();
  ctx.moveTo(size, 0);
  ctx.lineTo(-0.7 * size, 0.66 * size);
  ctx.lineTo(-0.35 * size, 0);
  ctx.lineTo(-0.7 * size, -0.66 * size);
  ctx.closePath();
  ctx.fill();
  ctx.lineWidth = 1.5;
  ctx.strokeStyle = colour("map");
  ctx.stroke();
  ctx.restore();
}

export function drawFlashes(view) {
  const { ctx, sx, sy } = view, now = performance.now();
  view.flashes = view.flashes.filter((flash) => now - flash.since < FLASH);
  for (const flash of view.flashes) {
    const t = (now - flash.since) / FLASH;
    ctx.strokeStyle = colour("loop");
    ctx.globalAlpha = 1 - t;
    ctx.lineWidth = 3;
    ctx.beginPath();
    ctx.arc(sx(flash.x), sy(flash.y), 10 + 60 * t, 0, 2 * Math.PI);
    ctx.stroke();
  }
  ctx.globalAlpha = 1;
  return view.flashes.length > 0;
}

export function drawScaleBar(view, width, height, bottom) {
  const { ctx, camera } = view, most = Math.min(140, width / 3);
  const metres = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200].findLast((m) => m * camera.scale <= most) || 0.1;
  const long = metres * camera.scale, x = -width / 2 + 14, y = height / 2 - bottom;
  ctx.strokeStyle = ctx.fillStyle = colour("muted");
  ctx.lineWidth = 1.5;
  ctx.beginPath();
  ctx.moveTo(x, y - 4);
  ctx.lineTo(x, y);
  ctx.lineTo(x + long, y);
  ctx.lineTo(x + long, y - 4);
  ctx.stroke();
  ctx.font = "11px system-ui";
  ctx.fillText(`${metres} m`, x + long + 6, y + 3);
}
