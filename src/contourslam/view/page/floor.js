// The floor: all that lay open between the lidar and what it saw, filled once, in a picture that is fixed to the world.

const FINEST = 0.08, MOST = 2200; // metres a pixel, and pixels a side
const MARGIN = 12; // m beyond what is known, so that the picture seldom has to be made anew
const MOVED = 0.06, PAUSE = 1500; // m by which the way may be off in it for a while, ms

export class Floor {
  constructor() {
    this.canvas = document.createElement("canvas");
    this.forget();
  }

  forget() {
    this.box = null;
    this.drawn = 0;
    this.poses = new Float32Array(0);
    this.madeAt = -Infinity;
  }

  /** Bring the picture up to date and put it on a canvas whose units are pixels of the camera, y down. */
  draw(ctx, model, lane, camera, style) {
    const shown = model.shown;
    if (style !== this.style || shown < this.drawn || this.stale(model, lane)) {
      this.forget();
      this.style = style;
      this.madeAt = performance.now();
    }
    for (let k = this.drawn; k < shown; k++) {
      if (!this.fill(model, lane, k)) {
        this.enlarge(model, lane, shown);
        k = -1; // all anew, in the larger picture
      }
    }
    this.drawn = shown;
    if (!this.box) return;
    const { x, y, step } = this.box, scale = step * camera.scale;
    ctx.imageSmoothingEnabled = true;
    ctx.drawImage(this.canvas, (x - camera.x) * camera.scale, -(y - camera.y) * camera.scale,
      this.canvas.width * scale, this.canvas.height * scale);
  }

  /** Whether the way has been revised by more than can be borne. */
  stale(model, lane) {
    const map = model.maps[lane];
    if (!map || map === this.checked) return false;
    if (performance.now() < this.madeAt + PAUSE) return false;
    this.checked = map;
    const pose = [0, 0, 0];
    for (let k = 0; k < this.drawn; k += 3) {
      model.pose(lane, k, pose);
      if (Math.abs(pose[0] - this.poses[3 * k]) + Math.abs(pose[1] - this.poses[3 * k + 1]) > MOVED) return true;
    }
    return false;
  }

  /** Make room for all knots that are shown. */
  enlarge(model, lane, shown) {
    const pose = [0, 0, 0], ink = model.ink.data, starts = model.inkStarts.data;
    let x0 = Infinity, y0 = Infinity, x1 = -Infinity, y1 = -Infinity;
    for (let k = 0; k < shown; k++) {
      model.pose(lane, k, pose);
      let reach = 1;
      for (let i = 2 * starts[k]; i < 2 * starts[k + 1]; i += 2) reach = Math.max(reach, Math.abs(ink[i]), Math.abs(ink[i + 1]));
      reach *= 1.42 * model.unit;
      x0 = Math.min(x0, pose[0] - reach); x1 = Math.max(x1, pose[0] + reach);
      y0 = Math.min(y0, pose[1] - reach); y1 = Math.max(y1, pose[1] + reach);
    }
    const width = x1 - x0 + 2 * MARGIN, height = y1 - y0 + 2 * MARGIN;
    const step = Math.max(FINEST, width / MOST, height / MOST);
    this.box = { x: x0 - MARGIN, y: y1 + MARGIN, step };
    this.canvas.width = Math.ceil(width / step);
    this.canvas.height = Math.ceil(height / step);
    this.context = this.canvas.getContext("2d");
    this.context.fillStyle = this.context.strokeStyle = this.style;
    this.context.lineWidth = 1;
  }

  /** Fill what one knot saw; false where it does not fit into the picture. */
  fill(model, lane, k) {
    if (!this.box) return false;
    const { x, y, step } = this.box, ctx = this.context, pose = model.pose(lane, k, [0, 0, 0]);
    const ink = model.ink.data, starts = model.inkStarts.data, unit = model.unit / step;
    const ox = (pose[0] - x) / step, oy = (y - pose[1]) / step;
    const c = Math.cos(pose[2]) * unit, s = Math.sin(pose[2]) * unit;
    const { width, height } = this.canvas;
    ctx.beginPath();
    let lastX = 1e9, lastY = 1e9;
    for (let i = 2 * starts[k]; i < 2 * starts[k + 1]; i += 2) {
      const px = ox + c * ink[i] - s * ink[i + 1], py = oy - s * ink[i] - c * ink[i + 1];
      if (px < 0 || py < 0 || px > width || py > height) return false;
      const near = 0.14 * Math.hypot(px - ox, py - oy) + 0.15 / step;
      if (Math.hypot(px - lastX, py - lastY) > near) ctx.moveTo(ox, oy);
      ctx.lineTo(px, py);
      lastX = px;
      lastY = py;
    }
    ctx.fill("nonzero");
    if (3 * k + 3 > this.poses.length) {
      const more = new Float32Array(Math.max(3 * k + 3, 2 * this.poses.length, 3000));
      more.set(this.poses);
      this.poses = more;
    }
    this.poses.set(pose, 3 * k);
    return true;
  }
}
