// One lane's map: the building, walls, corners with their ellipses, the way, the robot, and what it sees now.

import { colour, contourColour, laneColour } from "./colours.js";
import { Floor } from "./floor.js";
import { Ink } from "./ink.js";

const SIGMAS = 3, LIFTS = [1, 2, 5, 10, 20, 50, 100]; // ellipses are drawn larger until half of them can be seen
const FLASH = 1600; // ms

export const LAYERS = [
  ["floor", "Free floor", "floor", true],
  ["ink", "All points", "muted", true],
  ["walls", "Walls", "wall", true],
  ["corners", "Corners and ellipses", "corner", true],
  ["ids", "Numbers of corners", "corner", false],
  ["path", "Trajectory", "lane0", true],
  ["odometry", "Raw odometry", "raw", false],
  ["truth", "True trajectory", "truth", true],
  ["scan", "Scan, by contour", "accent", true],
  ["response", "Detector response", "bad", true],
  ["pairs", "Associations", "good", true],
  ["loops", "Closed loops", "loop", true],
];

export class LaneMap {
  constructor(lane, name, camera, chosen) {
    this.lane = lane;
    this.camera = camera;
    this.ink = new Ink();
    this.floor = new Floor();
    this.figure = document.createElement("figure");
    this.figure.className = "lane";
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `Map by ${name}`);
    this.canvas.dataset.lane = lane;
    const caption = document.createElement("figcaption");
    const title = document.createElement("b");
    title.textContent = name.replaceAll("_", " ");
    this.facts = document.createElement("span");
    caption.append(title, this.facts);
    this.figure.append(caption, this.canvas);
    camera.attach(this.canvas, (point) => chosen(lane, point));
    this.flashes = [];
  }

  /** Other knots may come now. */
  forget() {
    this.floor.forget();
    this.ink.key = "";
  }

  flash(x, y) {
    this.flashes.push({ x, y, since: performance.now() });
  }

  /** What the map fills, for the camera. */
  box(model) {
    const box = [Infinity, Infinity, -Infinity, -Infinity], pose = [0, 0, 0];
    const add = (x, y) => {
      if (x < box[0]) box[0] = x;
      if (y < box[1]) box[1] = y;
      if (x > box[2]) box[2] = x;
      if (y > box[3]) box[3] = y;
    };
    const ink = model.ink.data, starts = model.inkStarts.data, far = 12 / model.unit;
    const every = Math.max(2, Math.floor(model.shown / 400));
    for (let k = 0; k < model.shown; k += k < 20 ? 1 : every) {
      model.pose(this.lane, k, pose);
      add(pose[0], pose[1]);
      const c = Math.cos(pose[2]) * model.unit, s = Math.sin(pose[2]) * model.unit;
      for (let i = 2 * starts[k]; i < 2 * starts[k + 1]; i += 18) {
        if (Math.abs(ink[i]) > far || Math.abs(ink[i + 1]) > far) continue;
        add(pose[0] + c * ink[i] - s * ink[i + 1], pose[1] + s * ink[i] + c * ink[i + 1]);
      }
    }
    add(...model.frame.lanes[this.lane].pose);
    return box;
  }

  /** From the lidar's frame to the world, at the pose that is shown. */
  lidar(model) {
    const [x, y, a] = model.frame.lanes[this.lane].pose, [mx, my, ma] = model.about.mount;
    const c = Math.cos(a), s = Math.sin(a), cm = Math.cos(a + ma), sm = Math.sin(a + ma);
    const ox = x + c * mx - s * my, oy = y + s * mx + c * my;
    return (px, py) => [ox + cm * px - sm * py, oy + sm * px + cm * py];
  }

  /** Nearest corner to a point of the canvas (pixels from its middle); -1 where there is none. */
  cornerAt(model, [px, py]) {
    const map = model.maps[this.lane];
    if (!map) return -1;
    const x = this.camera.x + px / this.camera.scale, y = this.camera.y - py / this.camera.scale;
    let best = 18 / this.camera.scale, found = -1;
    for (let i = 0; i < map.corner_ids.length; i++) {
      const apart = Math.hypot(map.corners[2 * i] - x, map.corners[2 * i + 1] - y);
      if (apart < best) { best = apart; found = map.corner_ids[i]; }
    }
    return found;
  }

  /** Draw everything; true where something still moves. */
  draw(model, layers, selected) {
    const { canvas, camera } = this, ratio = Math.min(devicePixelRatio || 1, 2);
    const width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    if (!width || !height) return false;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const ctx = this.ctx = canvas.getContext("2d"), frame = model.frame.lanes[this.lane], map = model.maps[this.lane];
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    ctx.clearRect(0, 0, canvas.width, canvas.height);
    ctx.setTransform(ratio, 0, 0, ratio, ratio * width / 2, ratio * height / 2);
    if (layers.floor) this.floor.draw(ctx, model, this.lane, camera, colour("floor"));
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    if (layers.ink) {
      ctx.drawImage(this.ink.draw(model, this.lane, camera, width, height, ratio, colour("ink")), 0, 0);
    }
    ctx.setTransform(ratio, 0, 0, ratio, ratio * width / 2, ratio * height / 2);
    ctx.lineJoin = ctx.lineCap = "round";
    const { scale } = camera;
    this.sx = (x) => (x - camera.x) * scale;
    this.sy = (y) => -(y - camera.y) * scale;
    this.scaleBar(width, height);
    if (layers.odometry) this.line(model.track(1), colour("raw"), 1.2);
    if (layers.truth) this.line(model.track(4), colour("truth"), 1.6, [6, 5]);
    if (map && layers.loops) this.loops(map);
    if (layers.path) this.path(model, frame);
    if (map && layers.walls) this.walls(map, frame);
    if (layers.pairs && map) this.pairs(frame, map);
    if (layers.scan) this.scan(model, frame, layers.response);
    this.lift = map && layers.corners ? this.corners(map, frame, layers.ids, selected) : 1;
    this.robot(frame);
    const moving = this.drawFlashes();
    this.facts.textContent = map
      ? `${map.corner_ids.length} corners · ${map.wall_ids.length} walls`
        + (map.loop_methods.length ? ` · ${map.loop_methods.length} ties to earlier places` : "")
      : "";
    return moving;
  }

  line(points, style, width, dash = []) {
    const { ctx, sx, sy } = this;
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

  path(model, frame) {
    const n = model.shown, points = new Float32Array(2 * n + 2), pose = [0, 0, 0];
    for (let k = 0; k < n; k++) {
      model.pose(this.lane, k, pose);
      points[2 * k] = pose[0];
      points[2 * k + 1] = pose[1];
    }
    points[2 * n] = frame.pose[0];
    points[2 * n + 1] = frame.pose[1];
    this.line(points, laneColour(this.lane), 1.6);
  }

  walls(map, frame) {
    const { ctx, sx, sy } = this, seen = new Set(frame.matched), strokes = [new Path2D(), new Path2D()];
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

  corners(map, frame, ids, selected) {
    const { ctx, sx, sy, camera } = this, n = map.corner_ids.length, axes = new Float32Array(3 * n), majors = [];
    for (let i = 0; i < n; i++) {
      const [a, b, c] = map.covariances.subarray(3 * i, 3 * i + 3), middle = (a + c) / 2;
      const half = Math.hypot((a - c) / 2, b);
      axes[3 * i] = SIGMAS * Math.sqrt(Math.max(middle + half, 0));
      axes[3 * i + 1] = SIGMAS * Math.sqrt(Math.max(middle - half, 0));
      axes[3 * i + 2] = 0.5 * Math.atan2(2 * b, a - c);
      majors.push(axes[3 * i]);
    }
    majors.sort((p, q) => p - q);
    const typical = (majors[n >> 1] || 1) * camera.scale;
    const lift = LIFTS.find((f) => f * typical >= 5) || LIFTS.at(-1);
    const seen = new Set(frame.matched), missed = new Set(frame.missed), style = colour("corner");
    for (let i = 0; i < n; i++) {
      const id = map.corner_ids[i], x = sx(map.corners[2 * i]), y = sy(map.corners[2 * i + 1]);
      const [p, q, turn] = axes.subarray(3 * i, 3 * i + 3), k = camera.scale * lift, thin = camera.scale < 20 ? 0.7 : 1;
      const chosen = selected && selected.lane === this.lane && selected.id === id;
      ctx.strokeStyle = ctx.fillStyle = missed.has(id) ? colour("bad") : seen.has(id) ? colour("good") : style;
      ctx.lineWidth = chosen ? 2 : thin;
      ctx.beginPath();
      ctx.ellipse(x, y, Math.min(p * k, 4e3), Math.min(q * k, 4e3), -turn, 0, 2 * Math.PI);
      ctx.globalAlpha = 0.14;
      ctx.fill();
      ctx.globalAlpha = 0.85;
      ctx.stroke();
      ctx.globalAlpha = 1;
      this.cornerMark(x, y, map.directions[i], map.openings[i], map.convex[i]);
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
    return lift;
  }

  /** Two short strokes along the sides; the dot is filled where matter fills the angle. */
  cornerMark(x, y, direction, opening, convex) {
    const { ctx, camera } = this, length = Math.max(4, Math.min(0.28 * camera.scale, 9));
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
  pairs(frame, map) {
    const { ctx, sx, sy } = this, [x, y] = [sx(frame.pose[0]), sy(frame.pose[1])];
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

  /** The scan by contour; the detector's response stands on it as a crest, towards the lidar's side. */
  scan(model, frame, response) {
    const { ctx, sx, sy } = this, { points, starts } = model.frame, at = this.lidar(model);
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
    const { curve, curve_starts: cs, response: r, candidates } = frame, crest = Math.max(5, Math.min(0.35 * this.camera.scale, 26)), high = crest / Math.max(frame.threshold, 1e-6);
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
    const mark = Math.max(2, Math.min(0.08 * this.camera.scale, 4));
    for (const i of candidates) {
      const [x, y] = at(curve[2 * i], curve[2 * i + 1]);
      ctx.strokeRect(sx(x) - mark, sy(y) - mark, 2 * mark, 2 * mark);
    }
  }

  loops(map) {
    const { ctx, sx, sy } = this, styles = [[0.16, 1], [0.9, 2], [0.9, 2]];
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

  robot(frame) {
    const { ctx, sx, sy, camera } = this, [x, y, a] = frame.pose, px = sx(x), py = sy(y);
    const [xx, xy, yy, , , tt] = frame.covariance, middle = (xx + yy) / 2, half = Math.hypot((xx - yy) / 2, xy);
    const style = laneColour(this.lane), k = SIGMAS * camera.scale;
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

  drawFlashes() {
    const { ctx, sx, sy } = this, now = performance.now();
    this.flashes = this.flashes.filter((flash) => now - flash.since < FLASH);
    for (const flash of this.flashes) {
      const t = (now - flash.since) / FLASH;
      ctx.strokeStyle = colour("loop");
      ctx.globalAlpha = 1 - t;
      ctx.lineWidth = 3;
      ctx.beginPath();
      ctx.arc(sx(flash.x), sy(flash.y), 10 + 60 * t, 0, 2 * Math.PI);
      ctx.stroke();
    }
    ctx.globalAlpha = 1;
    return this.flashes.length > 0;
  }

  scaleBar(width, height) {
    const { ctx, camera } = this, most = Math.min(140, width / 3);
    const metres = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200].findLast((m) => m * camera.scale <= most) || 0.1;
    const long = metres * camera.scale, x = -width / 2 + 14, y = height / 2 - (width < 480 ? 62 : 40);
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
}
