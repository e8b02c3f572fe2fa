// The floor: all that lay open between the lidar and what it saw, filled once, in a picture that is fixed to the world.

const FINEST = 0.08, MOST = 2200; // metres a pixel, and pixels a side
const MARGIN = 12; // m beyond what is known, so that the picture seldom has to be made anew
const MOVED = 0.06, PAUSE = 1500; // m by which the way may be off in it for a while, ms
const SLICE = 5, FIRST_SLICE = 16; // ms of each frame that may go into it, and while there is nothing to show

export class Floor {
  constructor() {
    this.forget();
  }

  forget() {
    this.shownSheet = null;
    this.sheet = null; // the one that is being made; the same as the one that is shown once it is complete
  }

  /** Put the picture on a canvas whose units are pixels of the camera, y down; true where it is not yet complete. */
  draw(ctx, model, lane, camera, style) {
    const shown = model.shown, front = this.shownSheet;
    if (front && (style !== front.style || shown < front.drawn)) this.forget();
    if (!this.sheet || (this.sheet === front && front.stale(model, lane))) this.sheet = new Sheet(model, lane, shown, style);
    const until = performance.now() + (this.shownSheet && this.shownSheet !== this.sheet ? SLICE : FIRST_SLICE);
    let { sheet } = this;
    while (sheet.drawn < shown && performance.now() < until) {
      if (!sheet.fill(model, lane, sheet.drawn)) sheet = this.sheet = new Sheet(model, lane, shown, style);
    }
    if (sheet.drawn >= shown || !this.shownSheet) this.shownSheet = sheet;
    const { x, y, step, canvas } = this.shownSheet, scale = step * camera.scale;
    ctx.imageSmoothingEnabled = true;
    ctx.drawImage(canvas, (x - camera.x) * camera.scale, -(y - camera.y) * camera.scale, canvas.width * scale,
      canvas.height * scale);
    return sheet.drawn < shown;
  }
}

/** One picture, with room for all knots that are shown. */
class Sheet {
  constructor(model, lane, shown, style) {
    this.style = style;
    this.drawn = 0;
    this.poses = new Float32Array(0);
    this.madeAt = performance.now();
    this.map = model.maps[lane];
    this.enlarge(model, lane, shown);
  }

  /** Whether the way has been revised by more than can be borne. */
  stale(model, lane) {
    const map = model.maps[lane];
    if (!map || map === this.map || performance.now() < this.madeAt + PAUSE) return false;
    this.map = map;
    const pose = [0, 0, 0];
    for (let k = 0; k < this.drawn; k += 3) {
      model.pose(lane, k, pose);
      if (Math.abs(pose[0] - this.poses[3 * k]) + Math.abs(pose[1] - this.poses[3 * k + 1]) > MOVED) return true;
    }
    return false;
  }

  /** Make room. */
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
    if (!shown) [x0, y0, x1, y1] = [-1, -1, 1, 1];
    const width = x1 - x0 + 2 * MARGIN, height = y1 - y0 + 2 * MARGIN;
    const step = Math.max(FINEST, width / MOST, height / MOST);
    [this.x, this.y, this.step] = [x0 - MARGIN, y1 + MARGIN, step];
    this.canvas = document.createElement("canvas");
    this.canvas.width = Math.ceil(width / step);
    this.canvas.height = Math.ceil(height / step);
    this.context = this.canvas.getContext("2d");
    this.context.fillStyle = this.context.strokeStyle = this.style;
    this.context.lineWidth = 1;
  }

  /** Fill what one knot saw; false where it does not fit into the picture. */
  fill(model, lane, k) {
    const { x, y, step } = this, ctx = this.context, pose = model.pose(lane, k, [0, 0, 0]);
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
    this.drawn = k + 1;
    return true;
  }
}
