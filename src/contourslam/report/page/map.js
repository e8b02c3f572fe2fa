// A map that is zoomed, moved and asked: by mouse, fingers and keys.

const CLOSEST = 400; // times
const REACH = { corners: 11, walls: 5, way: 9, loops: 4, errors: 7 }; // px
const FIRST = { corners: 0.5, errors: 0.8, walls: 0.9, way: 1, loops: 1.1 }; // what is meant where several are near
const STEPS = { c: "corners", w: "walls", l: "loops" };
let wayTimes = null; // the first map that knows them tells the others

class MapFigure {
  constructor(figure) {
    this.figure = figure;
    this.stage = figure.querySelector(".stage");
    this.svg = this.stage.querySelector("svg");
    this.panel = new Panel(this.svg.querySelector("[data-panel]"));
    this.panel.equal = true;
    this.facts = JSON.parse(figure.querySelector("script")?.textContent ?? "{}");
    this.gather();
    this.live = shape(this.svg, "g", { "data-live": "" });
    this.card = new Card(this.stage);
    this.chosen = null; // { layer, index, pinned }
    this.tools();
    listen(this);
    moment.changed.addEventListener("change", () => this.mark());
    this.figure.classList.add("alive");
  }

  /** Where everything is that can be asked for: points of the drawing, in the order of the facts. */
  gather() {
    this.members = {};
    for (const layer of Object.keys(REACH)) {
      const part = this.panel.group.querySelector(`[data-inside] > [data-layer="${layer}"]`);
      const lines = layer === "walls" || layer === "loops";
      const found = [...part?.children ?? []] // edge and filling are one
        .filter((path) => !path.hasAttribute("data-filling") && (!lines || path.getAttribute("d").includes("l")))
        .flatMap((path) => pathPoints(path).map(([u, v]) => [u, v]));
      this.members[layer] = lines
        ? found.flatMap((point, i) => i % 2 ? [] : [[point, found[i + 1]]]) : found.map((point) => [point]);
    }
    for (const facts of Object.values(this.facts)) {
      let time = 0;
      facts.t = facts.dt?.map((step) => time += step);
    }
    wayTimes ??= this.facts.way?.t ?? null;
  }

  tools() {
    const bar = document.createElement("div");
    bar.className = "tools";
    this.stage.before(bar);
    this.layers = new Layers(this.panel, bar, () => this.redraw());
    const group = document.createElement("span");
    group.className = "zoom";
    for (const [text, title, act] of [["+", "Zoom in", () => this.zoom(1.6)], ["−", "Zoom out", () => this.zoom(1 / 1.6)],
      ["Fit", "Show all of it", () => this.fit()]]) {
      const button = Object.assign(document.createElement("button"), { type: "button", textContent: text, title });
      button.setAttribute("aria-label", title);
      button.addEventListener("click", act);
      group.append(button);
    }
    group.append(saveButton(this.figure, this.svg));
    bar.append(group);
    this.stage.tabIndex = 0;
    this.stage.setAttribute("role", "group");
    const steps = Object.entries(STEPS).filter(([, layer]) => this.facts[layer] && this.members[layer].length);
    const through = steps.length
      ? `; ${steps.map(([key]) => key.toUpperCase()).join(", ")} go through ${steps.map(([, layer]) => layer).join(", ")}` : "";
    this.stage.setAttribute("aria-label",
      `Map: arrows move it, plus and minus zoom, 0 shows all${through}, with Shift back; Escape lets go`);
    const hint = Object.assign(document.createElement("p"), { className: "hint" });
    hint.textContent = matchMedia("(pointer: coarse)").matches
      ? "Tap anything to ask for it. Two fingers move and zoom, once closer one finger moves."
      : "Point at anything to ask for it, click to hold it. Drag, double click, Ctrl and wheel (the wheel alone after a click) "
        + `and the keys ← ↑ → ↓ + − 0 move and zoom${through}.`;
    this.stage.after(hint);
  }

  /** Lay out for so many px of width, and no more than so many of height. */
  layout(width, tallest = Math.max(300, Math.min(0.78 * innerHeight, 820))) {
    const { panel } = this, wide = width >= 620, scale = panel.parts.scale !== null;
    const left = wide ? 62 : 48, right = scale && wide ? 110 : 12, top = wide ? 24 : 8, { base } = panel;
    const w = width - left - right;
    const h = Math.round(Math.max(Math.min(w * base.h / base.w, tallest), Math.min(w, 240)));
    const before = panel.frame.w / panel.view.w, whole = this.home === undefined || this.closeness() < 1.01;
    panel.frame = { x: left, y: top, w, h };
    panel.pageWidth = width;
    const height = h + top + 42;
    for (const [key, value] of Object.entries({ width, height, viewBox: `0 0 ${width} ${height}` }))
      this.svg.setAttribute(key, value);
    const perPx = Math.max(base.w / w, base.h / h);
    this.home = { w: w * perPx, h: h * perPx, x: base.x + (base.w - w * perPx) / 2, y: base.y + (base.h - h * perPx) / 2 };
    if (whole) panel.view = { ...this.home };
    else {
      const { view } = panel, [u, v] = [view.x + view.w / 2, view.y + view.h / 2];
      panel.view = { x: u - w / before / 2, y: v - h / before / 2, w: w / before, h: h / before };
    }
    this.redraw();
  }

  closeness() { return this.home.w / this.panel.view.w; }

  fit() {
    this.panel.view = { ...this.home };
    this.redraw();
  }

  /** Zoom about a point of the page's px; where none is given, about what is held, or the middle. */
  zoom(by, px, py) {
    const { panel } = this, { view, frame } = panel;
    const held = this.chosen?.pinned && panel.toPage(...this.members[this.chosen.layer][this.chosen.index][0]);
    if (px === undefined && held && panel.holds(...held)) [px, py] = held;
    const k = Math.min(CLOSEST, Math.max(0.5, this.closeness() * by)) / this.closeness();
    const [u, v] = panel.toDrawing(px ?? frame.x + frame.w / 2, py ?? frame.y + frame.h / 2);
    panel.view = { x: u - (u - view.x) / k, y: v - (v - view.y) / k, w: view.w / k, h: view.h / k };
    this.redraw();
  }

  move(dx, dy) {
    const { view, frame } = this.panel;
    view.x -= dx * view.w / frame.w;
    view.y -= dy * view.h / frame.h;
    this.redraw();
  }

  redraw() {
    // Whole, a finger scrolls the page; closer, it moves the map.
    this.stage.style.touchAction = this.closeness() > 1.02 ? "none" : "pan-x pan-y";
    if (this.pending) return;
    this.pending = requestAnimationFrame(() => this.drawNow());
  }

  drawNow() {
    cancelAnimationFrame(this.pending);
    this.pending = null;
    this.panel.draw();
    this.mark();
  }

  /** The thing nearest to a point of the page's px, of those that are shown and within reach. */
  at(px, py, reach = 1) {
    let best = null, least = Infinity;
    if (!this.panel.holds(px, py)) return null;
    for (const [layer, members] of Object.entries(this.members)) {
      if (!this.facts[layer] || !members.length || !this.layers.shown(layer)) continue;
      for (let index = 0; index < members.length; index++) {
        const away = this.distance(members[index], px, py) / (REACH[layer] * reach);
        if (away <= 1 && away * FIRST[layer] < least) [best, least] = [{ layer, index }, away * FIRST[layer]];
      }
    }
    return best;
  }

  distance(points, px, py) {
    const [ax, ay] = this.panel.toPage(...points[0]);
    if (points.length === 1) return Math.hypot(px - ax, py - ay);
    const [bx, by] = this.panel.toPage(...points[1]), [dx, dy] = [bx - ax, by - ay];
    const share = Math.max(0, Math.min(1, ((px - ax) * dx + (py - ay) * dy) / (dx * dx + dy * dy || 1)));
    return Math.hypot(px - ax - share * dx, py - ay - share * dy);
  }

  choose(found, pinned, aloud = false) {
    const same = found && this.chosen && found.layer === this.chosen.layer && found.index === this.chosen.index;
    if (same && this.chosen.pinned === pinned && !aloud) return;
    this.chosen = found && { ...found, pinned };
    this.figure.dataset.chosen = found ? `${found.layer} ${found.index}` : "";
    if (found) {
      const { layer, index } = found, points = this.members[layer][index];
      this.card.show(FACTS[layer](this.facts[layer], index, points.map((point) => this.panel.values(...point))), pinned, aloud);
      const time = timeOf(layer, this.facts[layer], index);
      if (pinned) moment.pin(time); else moment.hover(time);
    } else {
      this.card.hide();
      moment.set(null, pinned ? null : moment.pinned);
    }
    this.mark();
  }

  /** Draw what is chosen and the moment of the run, in px of the page. */
  mark() {
    this.live.replaceChildren();
    const { panel } = this, { x, y, w, h } = panel.frame;
    const times = this.facts.way?.t ?? wayTimes, { time } = moment;
    if (time !== null && times && this.members.way.length === times.length) {
      const i = nearest(times, time), [px, py] = panel.toPage(...this.members.way[i][0]);
      if (panel.holds(px, py)) {
        const heading = this.facts.way?.heading[i];
        if (heading !== undefined) {
          const turn = `translate(${px} ${py}) rotate(${-heading})`;
          shape(this.live, "path", { d: "M-7 -6L11 0L-7 6L-3 0z", transform: turn, class: "robot" });
        } else shape(this.live, "circle", { cx: px, cy: py, r: 6, class: "robot" });
      } else shape(this.live, "text", { x: x + w / 2, y: y + h - 8, "text-anchor": "middle", class: "value" },
        "the marked moment lies outside this view");
    }
    if (!this.chosen) return;
    const points = this.members[this.chosen.layer][this.chosen.index].map((point) => panel.toPage(...point));
    const inside = points.some((point) => panel.holds(...point));
    if (points.length === 2) {
      const [[ax, ay], [bx, by]] = points;
      if (inside) shape(this.live, "path", { d: `M${ax} ${ay}L${bx} ${by}`, class: "chosen" });
    } else if (inside && this.chosen.layer !== "way")
      shape(this.live, "circle", { cx: points[0][0], cy: points[0][1], r: 9, class: "chosen" });
    const [px, py] = this.pointer && !this.chosen.pinned ? this.pointer : points.find((point) => panel.holds(...point)) ?? points[0];
    this.card.box.hidden = !inside && !this.pointer;
    this.card.moveTo(px, py);
  }

  /** Go to the next thing of a layer, and to it where it is out of sight. */
  step(layer, by) {
    const many = this.members[layer].length;
    if (!many || !this.facts[layer] || !this.layers.shown(layer)) return;
    const from = this.chosen?.layer === layer ? this.chosen.index : by > 0 ? -1 : 0;
    const index = (from + by + many) % many, [u, v] = this.members[layer][index][0];
    const { panel } = this;
    if (!panel.holds(...panel.toPage(u, v)))
      Object.assign(panel.view, { x: u - panel.view.w / 2, y: v - panel.view.h / 2 });
    this.pointer = null;
    this.choose({ layer, index }, true, true);
    this.redraw();
  }
}

/** Where in a list, in any order, the value nearest to another one is. */
function nearest(values, value) {
  let best = 0;
  for (let i = 1; i < values.length; i++) if (Math.abs(values[i] - value) < Math.abs(values[best] - value)) best = i;
  return best;
}
