// A pair of axes of a drawing: laid out for the room there is, and looked at through a window that can be moved.

const NAMESPACE = "http://www.w3.org/2000/svg";

/** An element of a drawing, put into another one. */
function shape(parent, name, attributes = {}, text = "") {
  const made = parent.appendChild(document.createElementNS(NAMESPACE, name));
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.textContent = text;
  return made;
}

const numbers = (text) => text.trim().split(/\s+/).map(Number);

/** Points of a path whose pieces are relative to each other: [u, v, whether a line begins here]. */
function pathPoints(path) {
  const found = [];
  let [u, v, first, begins, skip] = [0, 0, null, false, false];
  for (const [, command, number] of path.getAttribute("d").matchAll(/([a-z])|(-?(?:\d*\.\d+|\d+))/g)) {
    if (command) {
      begins = command === "m";
      skip = command === "h";
    } else if (!skip) {
      if (first === null) { first = Number(number); continue; }
      u += first;
      v += Number(number);
      first = null;
      found.push([u, v, begins]);
      begins = false;
    }
  }
  return found;
}

class Panel {
  constructor(group) {
    this.group = group;
    this.parts = Object.fromEntries(["inside", "grid", "frame", "ticks", "legend", "scale"].map(
      (name) => [name, group.querySelector(`[data-${name}]`)]));
    const [x, y, w, h] = numbers(this.parts.inside.getAttribute("viewBox"));
    this.base = { x, y, w, h };
    this.view = { ...this.base }; // what is looked at, px of the drawing
    this.frame = { ...this.base }; // where it is shown, px of the page
    this.spans = [numbers(group.dataset.x), numbers(group.dataset.y)];
    this.log = group.hasAttribute("data-log");
    this.unit = group.dataset.unit;
  }

  /** From px of the drawing to what they stand for. */
  values(u, v) {
    const [[x0, x1], [y0, y1]] = this.spans, { x, y, w, h } = this.base;
    const up = y0 + (1 - (v - y) / h) * (y1 - y0);
    return [x0 + (u - x) / w * (x1 - x0), this.log ? 10 ** up : up];
  }

  drawingX(value) {
    const [x0, x1] = this.spans[0];
    return this.base.x + (value - x0) / (x1 - x0) * this.base.w;
  }

  drawingY(value) {
    const [y0, y1] = this.spans[1];
    return this.base.y + (1 - ((this.log ? Math.log10(value) : value) - y0) / (y1 - y0)) * this.base.h;
  }

  /** From px of the drawing to px of the page, and back. */
  toPage(u, v) {
    const { view, frame } = this;
    return [frame.x + (u - view.x) * frame.w / view.w, frame.y + (v - view.y) * frame.h / view.h];
  }

  toDrawing(px, py) {
    const { view, frame } = this;
    return [view.x + (px - frame.x) * view.w / frame.w, view.y + (py - frame.y) * view.h / frame.h];
  }

  holds(px, py) {
    const { x, y, w, h } = this.frame;
    return px >= x && px <= x + w && py >= y && py <= y + h;
  }

  draw() {
    const { inside, grid, frame, ticks, legend, scale } = this.parts, { x, y, w, h } = this.frame, { view } = this;
    for (const part of [inside, frame])
      for (const [key, value] of Object.entries({ x, y, width: w, height: h })) part.setAttribute(key, value.toFixed(1));
    inside.setAttribute("viewBox", [view.x, view.y, view.w, view.h].map((one) => one.toFixed(4)).join(" "));
    const lines = [];
    ticks.replaceChildren();
    const [left, bottom] = this.values(view.x, view.y + view.h), [right, top] = this.values(view.x + view.w, view.y);
    for (const value of roundNumbers(left, right, w / 90)) {
      const [px] = this.toPage(this.drawingX(value), 0);
      lines.push(`M${px.toFixed(1)} ${y}V${y + h}`);
      shape(ticks, "text", { x: px.toFixed(1), y: y + h + 16, "text-anchor": "middle" }, plain(value));
    }
    for (const value of this.log ? decades(bottom, top, h / 24) : roundNumbers(bottom, top, h / (this.equal ? 90 : 32))) {
      const [, py] = this.toPage(0, this.drawingY(value));
      lines.push(`M${x} ${py.toFixed(1)}H${x + w}`);
      shape(ticks, "text", { x: x - 7, y: (py + 4).toFixed(1), "text-anchor": "end" }, plain(value));
    }
    grid.setAttribute("d", lines.join(""));
    const [across, up] = ["x", "y"].map((axis) => this.group.querySelector(`[data-label="${axis}"]`));
    across.setAttribute("x", x + w / 2);
    across.setAttribute("y", y + h + 35);
    up.setAttribute("transform", `translate(${x - Math.min(46, x - 12)} ${y + h / 2}) rotate(-90)`);
    this.placeLegend(legend);
    if (scale) this.placeScale(scale);
  }

  /** One entry behind the other, those that are shown. */
  placeLegend(legend) {
    let px = this.frame.x;
    for (const entry of legend?.children ?? []) {
      if (entry.getAttribute("display") === "none") continue;
      const [mark, text] = entry.children, { y } = this.frame;
      mark.setAttribute("d", `M${px} ${y - 12}h16`);
      text.setAttribute("x", px + 21);
      text.setAttribute("y", y - 8);
      px += 36 + 6.6 * text.textContent.length;
    }
  }

  /** Beside the frame; where there is no room, smaller in its corner. */
  placeScale(scale) {
    const { x, y, w, h } = this.frame, beside = x + w + 96 <= this.pageWidth, [label] = [...scale.children].slice(-1);
    const boxes = scale.querySelectorAll("rect"), words = [...scale.querySelectorAll("text")].slice(0, -1);
    const left = beside ? x + w + 16 : x + w - 54, height = beside ? 0.6 * h : Math.min(110, 0.4 * h);
    const top = beside ? y + 0.2 * h : y + 30, step = height / boxes.length;
    const put = (part, attributes) => { for (const key in attributes) part.setAttribute(key, attributes[key]); };
    boxes.forEach((box, k) => put(box, { x: left, y: top + k * step, height: step + 0.5, width: beside ? 12 : 8 }));
    words.forEach((word, k) => put(word, { x: left + 17, y: top + height * (1 - k / (words.length - 1)) + 4 }));
    put(label, { x: beside ? left - 8 : x + w - 6, y: top - 12, "text-anchor": beside ? "start" : "end" });
    scale.setAttribute("font-size", beside ? 12 : 10);
  }
}

/** Round numbers between two, so many at most where that leaves three: fewer tell no scale. */
function roundNumbers(low, high, many) {
  const rough = (high - low) / Math.max(2, many), power = 10 ** Math.floor(Math.log10(rough));
  const factors = [10, 5, 2, 1, 0.5, 0.2, 0.1];
  let found = [];
  for (const factor of factors.slice(factors.findLastIndex((one) => power * one >= rough * 0.999))) {
    const step = power * factor;
    found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
    if (found.length >= 3) break;
  }
  return found;
}

/** Powers of ten between two values; twice and five times them too where there is room for so many. */
function decades(low, high, many) {
  const from = Math.floor(Math.log10(low)), to = Math.ceil(Math.log10(high));
  for (const factors of [[1, 2, 5], [1, 3], [1]]) {
    const found = [];
    for (let k = from; k <= to; k++)
      for (const factor of factors) if (factor * 10 ** k >= low && factor * 10 ** k <= high) found.push(factor * 10 ** k);
    if (found.length <= many || factors.length === 1) return found;
  }
}

const plain = (value) => String(Number(value.toPrecision(6)));
