// Walls and corners on a map, and which of them the robot recognises now.

import { colour } from "./colours.js";

const SIGMAS = 3, LIFTS = [1, 2, 5, 10, 20, 50, 100]; // ellipses are drawn larger until half of them can be seen

export function drawWalls(view, map, frame) {
  const { ctx, sx, sy } = view, seen = new Set(frame.matched), strokes = [new Path2D(), new Path2D()];
  for (let i = 0; i < map.wall_ids.length; i++) {
    const at = 4 * i, path = strokes[seen.has(map.wall_ids[i]) ? 1 : 0];
    path.moveTo(sx(map.walls[at]), sy(map.walls[at + 1]));
    path.lineTo(sx(map.walls[at + 2]), sy(map.walls[at + 3]));
  }
  ctx.strokeStyle = colour("wall");
  ctx.lineWidth = 2;
  ctx.stroke(strokes[0]);
  ctx.strokeStyle = colour("good");
  ctx.lineWidth = 2.6;
  ctx.stroke(strokes[1]);
}

/** How many times larger than they are the ellipses of all maps are drawn. */
export function liftOf(maps, scale) {
  const majors = maps.flatMap((map) => (map ? [...map.majors] : [])).sort((p, q) => p - q);
  const typical = SIGMAS * (majors[majors.length >> 1] || 1) * scale;
  return LIFTS.find((f) => f * typical >= 5) || LIFTS.at(-1);
}

export function drawCorners(view, map, frame, ids, selected, lift) {
  const { ctx, sx, sy, camera } = view, n = map.corner_ids.length, axes = new Float32Array(3 * n);
  for (let i = 0; i < n; i++) {
    const [a, b, c] = map.covariances.subarray(3 * i, 3 * i + 3), middle = (a + c) / 2;
    const half = Math.hypot((a - c) / 2, b);
    axes[3 * i] = SIGMAS * Math.sqrt(Math.max(middle + half, 0));
    axes[3 * i + 1] = SIGMAS * Math.sqrt(Math.max(middle - half, 0));
    axes[3 * i + 2] = 0.5 * Math.atan2(2 * b, a - c);
  }
  const seen = new Set(frame.matched), missed = new Set(frame.missed), style = colour("corner");
  for (let i = 0; i < n; i++) {
    const id = map.corner_ids[i], x = sx(map.corners[2 * i]), y = sy(map.corners[2 * i + 1]);
    const [p, q, turn] = axes.subarray(3 * i, 3 * i + 3), k = camera.scale * lift, thin = camera.scale < 20 ? 0.7 : 1;
    const chosen = selected && selected.lane === view.lane && selected.id === id;
    ctx.strokeStyle = ctx.fillStyle = missed.has(id) ? colour("bad") : seen.has(id) ? colour("good") : style;
    ctx.lineWidth = chosen ? 2 : thin;
    ctx.beginPath();
    ctx.ellipse(x, y, Math.min(p * k, 4e3), Math.min(q * k, 4e3), -turn, 0, 2 * Math.PI);
    ctx.globalAlpha = 0.14;
    ctx.fill();
    ctx.globalAlpha = 0.85;
    ctx.stroke();
    ctx.globalAlpha = 1;
    cornerMark(view, x, y, map.directions[i], map.openings[i], map.convex[i]);
    if (chosen) {
      ctx.beginPath();
      ctx.arc(x, y, 13, 0, 2 * Math.PI);
      ctx.stroke();
    }
    if (ids || chosen) {
      ctx.font = "11px system-ui";
      ctx.fillText(id, x + 8, y - 8);
    }
  }
}

/** Two short strokes along the sides; the dot is filled where matter fills the angle. */
function cornerMark(view, x, y, direction, opening, convex) {
  const { ctx, camera } = view, length = Math.max(4, Math.min(0.28 * camera.scale, 9));
  ctx.lineWidth = 1.5;
  ctx.beginPath();
  for (const side of [-0.5, 0.5]) {
    const a = direction + side * opening;
    ctx.moveTo(x, y);
    ctx.lineTo(x + length * Math.cos(a), y - length * Math.sin(a));
  }
  ctx.stroke();
  ctx.beginPath();
  ctx.arc(x, y, length / 3.2, 0, 2 * Math.PI);
  if (!convex) {
    ctx.save();
    ctx.fillStyle = colour("map");
    ctx.fill();
    ctx.restore();
    ctx.stroke();
  } else ctx.fill();
}

/** From the robot to each corner that was recognised, and from where it was seen to where the map has it. */
export function drawPairs(view, frame, map) {
  const { ctx, sx, sy } = view, [x, y] = [sx(frame.pose[0]), sy(frame.pose[1])];
  if (!frame.seen_ids) return;
  ctx.strokeStyle = colour("good");
  ctx.lineWidth = 1;
  ctx.globalAlpha = frame.looked ? 0.75 : 0.35;
  ctx.beginPath();
  for (let i = 0; i < frame.seen_corners; i++) {
    if (frame.seen_ids[i] < 0) continue;
    const [px, py] = [sx(frame.seen[2 * i]), sy(frame.seen[2 * i + 1])];
    ctx.moveTo(x, y);
    ctx.lineTo(px, py);
    const at = map.byId.get(frame.seen_ids[i]);
    if (at !== undefined) ctx.lineTo(sx(map.corners[2 * at]), sy(map.corners[2 * at + 1]));
  }
  ctx.stroke();
  ctx.strokeStyle = colour("bad");
  ctx.setLineDash([3, 4]);
  ctx.beginPath();
  for (const id of frame.missed) {
    const at = map.byId.get(id);
    if (at === undefined) continue;
    ctx.moveTo(x, y);
    ctx.lineTo(sx(map.corners[2 * at]), sy(map.corners[2 * at + 1]));
  }
  ctx.stroke();
  ctx.setLineDash([]);
  ctx.globalAlpha = 1;
}
