// A chart over time: a cursor tells the values of all lines at a moment, which all figures then show.

class ChartFigure {
  constructor(figure) {
    this.figure = figure;
    this.stage = figure.querySelector(".stage");
    this.svg = this.stage.querySelector("svg");
    this.panels = [...this.svg.querySelectorAll("[data-panel]")].map((group) => {
      const panel = new Panel(group);
      panel.series = [...group.querySelectorAll("[data-name]")].map((path) => this.series(path))
        .sort((one, other) => one.band - other.band);
      return panel;
    });
    this.live = shape(this.svg, "g", { "data-live": "" });
    this.spoken = Object.assign(document.createElement("div"), { className: "spoken" });
    this.spoken.setAttribute("role", "status");
    this.stage.after(this.spoken);
    const bar = Object.assign(document.createElement("div"), { className: "tools" });
    bar.append(saveButton(figure, this.svg));
    this.stage.before(bar);
    this.stage.tabIndex = 0;
    this.stage.setAttribute("role", "group");
    this.stage.setAttribute("aria-label", "Chart: left and right arrows move a cursor through time, Escape lets go of it");
    this.listen();
    moment.changed.addEventListener("change", () => this.mark());
    this.figure.classList.add("alive");
  }

  /** A line by its points, or a band by the points of both its sides. */
  series(path) {
    const points = pathPoints(path), band = path.getAttribute("fill") !== "none", half = points.length / 2;
    const upper = band ? points.slice(half).reverse() : points;
    return { name: path.dataset.name, colour: path.getAttribute("stroke"), lower: points.slice(0, upper.length), upper, band };
  }

  layout(width) {
    const wide = width >= 620, left = wide ? 62 : 58, right = wide ? 14 : 8;
    let y = 0;
    for (const panel of this.panels) {
      panel.frame = { x: left, y: y + 24, w: width - left - right, h: panel.base.h };
      panel.pageWidth = width;
      y += panel.base.h + 66;
    }
    for (const [key, value] of Object.entries({ width, height: y, viewBox: `0 0 ${width} ${y}` })) this.svg.setAttribute(key, value);
    this.drawNow();
  }

  drawNow() {
    for (const panel of this.panels) panel.draw();
    this.mark();
  }

  mark() {
    this.live.replaceChildren();
    const { time } = moment;
    this.said = [];
    if (time === null) return;
    for (const panel of this.panels) {
      const { x, y, w, h } = panel.frame, u = panel.drawingX(time), [px] = panel.toPage(u, 0);
      if (px < x - 1 || px > x + w + 1) continue;
      shape(this.live, "path", { d: `M${px} ${y}V${y + h}`, class: "cursor" });
      const words = [clock(time), ...panel.series.map((one) => this.told(panel, one, u, px)).filter(Boolean)];
      this.said.push(...words);
      // Above the frame; where that is too narrow for it beside the legend, inside.
      const above = panel.pageWidth >= 620;
      shape(this.live, "text", { x: x + w - (above ? 0 : 6), y: above ? y - 8 : y + 15, "text-anchor": "end", class: "value" },
        words.join("  ·  "));
    }
  }

  /** A series' value at a moment in words, with a dot on its line. */
  told(panel, { name, colour, lower, upper, band }, u, px) {
    if (!lower.length) return null;
    const i = nearest(lower.map((point) => point[0]), u);
    if (Math.abs(lower[i][0] - u) > panel.base.w / 40) return null; // a gap
    const [low, high] = [lower[i], upper[i]].map((point) => panel.values(point[0], point[1])[1]);
    if (band) return `${name} ${digits(low)} … ${digits(high)}${panel.unit && ` ${panel.unit}`}`;
    shape(this.live, "circle", { cx: px, cy: panel.toPage(...lower[i])[1], r: 4, fill: colour, class: "dot" });
    return `${name} ${digits(low)}${panel.unit && ` ${panel.unit}`}`;
  }

  listen() {
    const timeAt = (event) => {
      const box = this.svg.getBoundingClientRect(), { frame, spans: [[from, to]] } = this.panels[0];
      return from + Math.max(0, Math.min(1, (event.clientX - box.left - frame.x) / frame.w)) * (to - from);
    };
    this.svg.addEventListener("pointermove", (event) => moment.hover(timeAt(event)));
    this.svg.addEventListener("pointerleave", () => moment.hover(null));
    this.svg.addEventListener("click", (event) => moment.pin(timeAt(event)));
    this.stage.addEventListener("keydown", (event) => {
      const [from, to] = this.panels[0].spans[0], step = (to - from) / (event.shiftKey ? 20 : 200);
      const time = { ArrowLeft: (moment.time ?? to) - step, ArrowRight: (moment.time ?? from) + step, Home: from, End: to }[event.key];
      if (event.key === "Escape") moment.set(null, null);
      else if (time === undefined || event.ctrlKey || event.metaKey || event.altKey) return;
      else moment.pin(Math.max(from, Math.min(to, time)));
      event.preventDefault();
      this.spoken.textContent = this.said.join("; ");
    });
  }
}
