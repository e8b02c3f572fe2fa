// Where the maps are looked at from: one camera for all lanes; mouse, wheel, touch and keys.

const CLOSEST = 2000, WIDEST = 0.5; // pixels per metre

export class Camera {
  constructor(changed) {
    this.x = 0; this.y = 0; this.scale = 40; // the middle, m, and pixels per metre
    this.mode = "fit"; // "fit", "follow" or "free"
    this.changed = changed;
    this.pointers = new Map();
  }

  setMode(mode) {
    this.mode = mode;
    this.changed();
  }

  /** Take a canvas' gestures; `tap` is called with a point of the canvas. */
  attach(canvas, tap) {
    const at = (event) => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left - box.width / 2, event.clientY - box.top - box.height / 2];
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, at(event));
      this.moved = this.pointers.size > 1 ? 99 : 0;
      canvas.classList.add("held");
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = this.pointers.get(event.pointerId);
      if (!before) return;
      const now = at(event);
      this.moved += Math.hypot(now[0] - before[0], now[1] - before[1]);
      if (this.pointers.size === 1) {
        if (this.moved > 5) this.shift(now[0] - before[0], now[1] - before[1]);
      } else {
        const other = [...this.pointers].find(([id]) => id !== event.pointerId)[1];
        const apart = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]);
        this.shift((now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
        this.zoom(apart(now) / Math.max(apart(before), 1), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
      }
      this.pointers.set(event.pointerId, now);
    });
    const end = (event) => {
      const had = this.pointers.delete(event.pointerId);
      if (!this.pointers.size) canvas.classList.remove("held");
      if (had && event.type === "pointerup" && this.moved < 6 && !this.pointers.size) tap(at(event));
    };
    canvas.addEventListener("pointerup", end);
    canvas.addEventListener("pointercancel", end);
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 16 : 1;
      this.zoom(Math.exp(-Math.max(-120, Math.min(120, event.deltaY * lines)) / 300), ...at(event));
    }, { passive: false });
  }

  shift(dx, dy) {
    this.mode = "free";
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
    this.changed();
  }

  /** Zoom about a point, in pixels from the middle. */
  zoom(by, px = 0, py = 0) {
    const scale = Math.max(WIDEST, Math.min(CLOSEST, this.scale * by));
    if (this.mode === "follow") { px = 0; py = 0; } else this.mode = "free";
    this.x += px / this.scale - px / scale;
    this.y -= py / this.scale - py / scale;
    this.scale = scale;
    this.changed();
  }

  /** Let the box [x0, y0, x1, y1] fill a canvas of this size, with some room; it changes only when it must. */
  fit(box, width, height) {
    const [x0, y0, x1, y1] = box;
    if (!(x1 > x0)) return;
    const scale = Math.min(0.86 * width / Math.max(x1 - x0, 4), 0.82 * height / Math.max(y1 - y0, 4));
    const [x, y] = [(x0 + x1) / 2, (y0 + y1) / 2];
    const off = Math.hypot(x - this.x, y - this.y) * this.scale;
    if (scale < this.scale || scale > 1.5 * this.scale || off > 0.1 * width) {
      this.scale = Math.max(WIDEST, Math.min(CLOSEST, scale));
      this.x = x;
      this.y = y;
    }
  }

  key() {
    return `${this.x.toFixed(4)},${this.y.toFixed(4)},${this.scale.toFixed(4)}`;
  }
}
