// One lane's map: the building, walls, corners with their ellipses, the way, the robot, and what it sees now.

import { colour } from "./colours.js";
import { drawScan } from "./crest.js";
import { Floor } from "./floor.js";
import { Ink } from "./ink.js";
import { drawCorners, drawPairs, drawWalls, liftOf } from "./landmarks.js";
import { drawFlashes, drawLine, drawLoops, drawPath, drawRobot, drawScaleBar } from "./way.js";

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
    this.name = name;
    this.camera = camera;
    this.ink = new Ink();
    this.floor = new Floor();
    this.figure = document.createElement("figure");
    this.figure.className = "lane";
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "application");
    this.canvas.setAttribute("aria-roledescription", "map");
    this.canvas.setAttribute("aria-label", `Map by ${name.replaceAll("_", " ")}`);
    this.canvas.tabIndex = 0;
    this.canvas.dataset.lane = lane;
    const caption = document.createElement("figcaption");
    const title = document.createElement("b");
    title.textContent = name.replaceAll("_", " ");
    title.style.setProperty("--c", `var(--lane${lane})`);
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

  /** What the map shows, in words, for those who do not see it. */
  describe(model) {
    const { pose: [x, y, a], covariance: [xx, , yy, , , tt] } = model.frame.lanes[this.lane], degrees = 180 / Math.PI;
    const sigma = (100 * Math.sqrt(xx + yy)).toFixed(1);
    const words = `Map by ${this.name.replaceAll("_", " ")}: ${this.facts.textContent || "nothing drawn yet"}; robot at `
      + `${x.toFixed(2)}, ${y.toFixed(2)} m, heading ${(a * degrees).toFixed(0)}°, known to ${sigma} cm and `
      + `${(Math.sqrt(tt) * degrees).toFixed(2)}°. Arrow keys move the map, plus and minus zoom, Enter opens the corner `
      + "nearest to its middle.";
    this.canvas.setAttribute("aria-label", words);
  }

  /** Nearest corner to a point of the canvas (pixels from its middle), no farther than `reach`; -1 where there is none. */
  cornerAt(model, [px, py], reach = 18) {
    const map = model.maps[this.lane];
    if (!map) return -1;
    const x = this.camera.x + px / this.camera.scale, y = this.camera.y - py / this.camera.scale;
    let best = reach / this.camera.scale, found = -1;
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
    const filling = layers.floor && this.floor.draw(ctx, model, this.lane, camera, colour("floor"));
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    if (layers.ink) {
      ctx.drawImage(this.ink.draw(model, this.lane, camera, width, height, ratio, colour("ink")), 0, 0);
    }
    ctx.setTransform(ratio, 0, 0, ratio, ratio * width / 2, ratio * height / 2);
    ctx.lineJoin = ctx.lineCap = "round";
    const { scale } = camera;
    this.sx = (x) => (x - camera.x) * scale;
    this.sy = (y) => -(y - camera.y) * scale;
    // One is enough; below it stand the legend, or a phone's buttons.
    if (this.lane === 0) drawScaleBar(this, width, height, model.lanes > 2 ? 14 : width < 480 ? 62 : 40);
    if (layers.odometry) drawLine(this, model.track(1), colour("raw"), 1.2);
    if (map && layers.loops) drawLoops(this, map);
    if (layers.path) drawPath(this, model, frame);
    if (layers.truth) drawLine(this, model.track(4), colour("truth"), 1.4, [5, 6]);
    if (map && layers.walls) drawWalls(this, map, frame);
    if (layers.pairs && map && frame.localized) drawPairs(this, frame, map);
    if (layers.scan && frame.localized) drawScan(this, model, frame, layers.response);
    if (map && layers.corners) drawCorners(this, map, frame, layers.ids, selected, liftOf(model.maps, scale));
    if (frame.localized) drawRobot(this, frame); // else it is nowhere in this map
    const moving = drawFlashes(this) || filling;
    this.facts.textContent = map
      ? `${map.corner_ids.length} corners · ${map.wall_ids.length} walls`
        + (map.loop_methods.length ? ` · ${map.loop_methods.length} tie${map.loop_methods.length > 1 ? "s" : ""} to earlier places` : "")
      : "";
    return moving;
  }
}
