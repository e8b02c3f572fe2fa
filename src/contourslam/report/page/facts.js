// What is told of a corner, a wall, a pose, a loop or an error when it is asked for: a title and names with values.

const digits = (value, many = 3) => value === null || !Number.isFinite(value) ? "–" : String(Number(value.toPrecision(many)));

/** A length in mm, in the unit in which it is a handy number. */
function long(mm) {
  if (mm === null) return "–";
  const [scale, unit] = mm >= 1000 ? [1000, "m"] : mm >= 10 ? [10, "cm"] : [1, "mm"];
  return `${digits(mm / scale)} ${unit}`;
}

/** How often a landmark was seen and missed, and what part of the time missed. */
const seen = (o, f) => [
  ["seen, o", o.toLocaleString("en")], ["missed, f", f.toLocaleString("en")],
  ["f / (f + o)", o + f ? (f / (f + o)).toFixed(3) : "–"],
];

const place = ([x, y]) => `x ${x.toFixed(3)} m, y ${y.toFixed(3)} m`;

const FACTS = {
  corners: (f, i, at) => [`Corner c${f.id[i]}, ${f.convex[i] ? "convex" : "concave"}`, [
    ["place", place(at[0])],
    ["σ along its axes", `${long(f.major[i])}, ${long(f.minor[i])}`],
    ["longer axis", `${f.tilt[i]}°`],
    ["opening", `${f.opening[i]}°`],
    ...seen(f.o[i], f.f[i]),
  ]],
  walls: (f, i, at) => [`Wall w${f.id[i]}`, [
    ["length", long(1000 * Math.hypot(at[1][0] - at[0][0], at[1][1] - at[0][1]))],
    ["σ across it", long(f.shift[i])],
    ["σ of its direction", `${digits(f.turn[i])}°`],
    ...seen(f.o[i], f.f[i]),
  ]],
  way: (f, i, at) => [`Pose at ${clock(f.t[i])}`, [
    ["place", place(at[0])],
    ["heading", `${f.heading[i]}°`],
    ["σ of the place", long(f.sigma[i])],
    ["σ of the heading", `${digits(f.turn[i])}°`],
    ...(f.nis ? [["NIS per d. o. f.", digits(f.nis[i])]] : []),
  ]],
  loops: (f, i) => [`Loop ${clock(f.from[i])} → ${clock(f.to[i])}`, [
    ["moved the pose by", `${long(f.shift[i])}, ${digits(f.turn[i])}°`],
    ["found by", f.method[i]],
    ["pairs", String(f.pairs[i])],
    ["residual", long(f.residual[i])],
    ["overlap", `${digits(100 * f.overlap[i])} %`],
    ["runner-up", digits(f.runner[i])],
  ]],
  errors: (f, i, at) => [`Relation at ${clock(f.t[i])}`, [["error", long(f.error[i])], ["place", place(at[0])]]],
};

/** When a thing of a layer was; null where it has no time of its own. */
const timeOf = (layer, f, i) => layer === "loops" ? f.to[i] : f.t?.[i] ?? null;

/** A card that stands beside what it tells of, and can be held. */
class Card {
  constructor(stage) {
    this.stage = stage;
    this.box = stage.appendChild(document.createElement("div"));
    this.box.className = "card";
    this.box.hidden = true;
    this.spoken = stage.appendChild(document.createElement("div"));
    this.spoken.className = "spoken";
    this.spoken.setAttribute("role", "status");
  }

  show([title, rows], pinned, aloud) {
    const heading = Object.assign(document.createElement("strong"), { textContent: title });
    const list = document.createElement("dl");
    for (const [name, value] of rows)
      list.append(Object.assign(document.createElement("dt"), { textContent: name }),
        Object.assign(document.createElement("dd"), { textContent: value }));
    this.box.replaceChildren(heading, list);
    this.box.classList.toggle("pinned", pinned);
    this.box.hidden = false;
    if (aloud) this.spoken.textContent = `${title}: ${rows.map((row) => row.join(" ")).join("; ")}`;
  }

  hide() {
    this.box.hidden = true;
    this.spoken.textContent = "";
  }

  /** Beside a point of the stage, on the side where there is room; else above or below it. */
  moveTo(px, py) {
    const { clientWidth: width, clientHeight: height } = this.stage, { offsetWidth: w, offsetHeight: h } = this.box;
    const beside = px + 16 + w <= width || px - 16 - w >= 0;
    const left = px + 16 + w <= width ? px + 16 : px - 16 - w, top = py + 16 + h <= height ? py + 16 : py - 16 - h;
    this.box.style.left = `${Math.max(4, Math.min(beside ? left : px - w / 2, width - w - 4))}px`;
    this.box.style.top = `${Math.max(4, Math.min(beside ? py - h / 2 : top, height - h - 4))}px`;
  }
}
