// The building: all contour points seen along the way, counted by pixel. Only what is new is added while nothing moves.

const MOST = 900_000; // points drawn at once; of more, every second, third ... one

export class Ink {
  constructor() {
    this.canvas = document.createElement("canvas");
    this.counts = new Uint16Array(0);
    this.key = "";
    this.drawn = 0;
    this.reach = 0;
  }

  /** Bring the picture up to date; gives the canvas. */
  draw(model, lane, camera, width, height, ratio, rgb) {
    const w = Math.max(1, Math.round(width * ratio)), h = Math.max(1, Math.round(height * ratio));
    const map = model.maps[lane], shown = model.shown;
    const key = `${camera.key()}|${w}x${h}|${rgb}|${map ? map.version : 0}`;
    if (key === this.key && shown === this.drawn) return this.canvas;
    if (key !== this.key || shown < this.drawn) {
      if (this.counts.length !== w * h) {
        this.canvas.width = w;
        this.canvas.height = h;
        this.counts = new Uint16Array(w * h);
        this.context = this.canvas.getContext("2d");
        this.image = this.context.createImageData(w, h);
        this.pixels = new Uint32Array(this.image.data.buffer);
      } else {
        this.counts.fill(0);
      }
      if (!this.key.includes(`|${rgb}|`)) this.shades = shades(rgb);
      this.key = key;
      this.drawn = 0;
    }
    this.count(model, lane, camera, w, h, ratio, this.drawn, shown);
    this.drawn = shown;
    const { counts, pixels, shades: table } = this, last = table.length - 1;
    for (let i = 0; i < counts.length; i++) {
      const n = counts[i];
      pixels[i] = table[n < last ? n : last];
    }
    this.context.putImageData(this.image, 0, 0);
    return this.canvas;
  }

  count(model, lane, camera, w, h, ratio, from, to) {
    const starts = model.inkStarts.data, ink = model.ink.data, { counts } = this, pose = [0, 0, 0];
    const stride = Math.max(1, Math.ceil(starts[to] / MOST));
    const scale = camera.scale * ratio, unit = model.unit * scale;
    const edge = 25 * scale; // what lies farther beyond the picture is not seen in it, or hardly
    for (let k = from; k < to; k++) {
      model.pose(lane, k, pose);
      const x0 = w / 2 + (pose[0] - camera.x) * scale, y0 = h / 2 - (pose[1] - camera.y) * scale;
      if (x0 < -edge || y0 < -edge || x0 > w + edge || y0 > h + edge) continue;
      const c = Math.cos(pose[2]) * unit, s = Math.sin(pose[2]) * unit;
      for (let i = 2 * starts[k], end = 2 * starts[k + 1]; i < end; i += 2 * stride) {
        const px = (x0 + c * ink[i] - s * ink[i + 1]) | 0, py = (y0 - s * ink[i] - c * ink[i + 1]) | 0;
        if (px >= 0 && py >= 0 && px < w - 1 && py < h) {
          const at = py * w + px;
          counts[at] += 1;
          counts[at + 1] += 1;
        }
      }
    }
  }
}

/** Colours by count, as the canvas has them in memory. */
function shades(rgb) {
  const [r, g, b] = rgb.split(" ").map(Number), table = new Uint32Array(64);
  for (let n = 1; n < table.length; n++) {
    const alpha = Math.min(255, Math.round(30 + 62 * Math.log2(1 + n)));
    table[n] = (alpha << 24) | (b << 16) | (g << 8) | r;
  }
  return table;
}
