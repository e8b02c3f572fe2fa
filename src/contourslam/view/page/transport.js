// Play, pause, step, speed, and the time line.

import { minutes } from "./charts.js";
import { colour } from "./colours.js";

const $ = (id) => document.getElementById(id);
const SPEEDS = [0.5, 1, 2, 5, 10, 20, 50, 100];
const PLAY = "M5 3l12 7-12 7z", PAUSE = "M5 3h3.5v14H5zM11.5 3H15v14h-3.5z";
const REST = 40; // ms between two requests while the time line is dragged

export class Transport {
  constructor(model, send) {
    this.model = model;
    this.send = send;
    this.held = false;
    this.wanted = null;
    for (const speed of [...SPEEDS, null]) this.addSpeed(speed);
    $("play").onclick = () => this.toggle();
    $("back").onclick = () => send("step", -1);
    $("forward").onclick = () => send("step", 1);
    $("latest").onclick = () => send("follow");
    $("speed").onchange = () => send("speed", $("speed").value === "max" ? null : Number($("speed").value));
    const slider = $("time");
    slider.addEventListener("input", () => this.drag(Number(slider.value)));
    slider.addEventListener("pointerdown", () => { this.held = true; });
    slider.addEventListener("change", () => {
      this.held = false;
      this.flush();
    });
  }

  /** Another connection: of a recording, which can be paused, or of a robot, which goes on whatever a page holds. */
  begin(live) {
    this.live = live;
    this.words = live ? ["Hold", "Go on", "Hold what is shown here; the robot goes on (space)"]
      : ["Pause", "Play", "Play or pause (space)"];
    $("play").title = this.words[2];
    $("latest").textContent = live ? "Live" : "Newest";
    $("latest").title = live ? "Go back to what is now" : "Go to the newest scan";
  }

  addSpeed(speed) {
    const option = document.createElement("option");
    option.value = speed === null ? "max" : speed;
    option.textContent = speed === null ? "fastest" : `${speed}×`;
    const after = [...$("speed").options].find((o) => o.value === "max" || Number(o.value) > speed);
    $("speed").insertBefore(option, speed === null ? null : after || null);
    return option;
  }

  toggle() {
    const { status } = this.model;
    if (!status) return;
    this.send(this.goesOn(status) ? "pause" : "play");
  }

  /** Whether time goes on for this page. */
  goesOn(status) {
    return !status.paused && (status.state !== "finished" || status.at !== null);
  }

  /** Ask for a time, not more often than is worth it. */
  drag(time) {
    this.wanted = time;
    this.clock(time);
    if (!this.waiting) this.flush();
  }

  flush() {
    if (this.wanted === null) return;
    this.send("seek", this.wanted);
    this.wanted = null;
    this.waiting = setTimeout(() => {
      this.waiting = null;
      this.flush();
    }, REST);
  }

  draw() {
    const { status, frame, about } = this.model;
    if (!status) return;
    const length = Math.max(about.duration || 0, status.head, 1);
    const slider = $("time");
    slider.max = length;
    if (frame && !this.held) {
      slider.value = frame.elapsed;
      this.clock(frame.elapsed);
    }
    slider.setAttribute("aria-valuetext", `${minutes(Number(slider.value))} of ${minutes(length)}`);
    const on = this.goesOn(status);
    $("playicon").setAttribute("d", on ? PAUSE : PLAY);
    $("play").setAttribute("aria-label", this.words[on ? 0 : 1]);
    $("speed").parentElement.hidden = this.live && status.at === null; // nothing but looking back has a speed
    $("latest").disabled = status.at === null;
    const value = status.speed === null ? "max" : String(status.speed), select = $("speed");
    if (document.activeElement !== select || select.dataset.known !== value) {
      if (![...select.options].some((option) => option.value === value)) this.addSpeed(status.speed);
      select.value = select.dataset.known = value;
    }
    this.marks(length, status.head);
  }

  clock(elapsed) {
    const { frame, about, status } = this.model, total = Math.max(about.duration || 0, status ? status.head : 0);
    const now = document.createElement("b");
    now.textContent = minutes(elapsed);
    const scan = document.createElement("span");
    scan.className = "scanword";
    scan.textContent = frame ? ` · scan ${frame.index}` : "";
    $("clock").replaceChildren(now, ` / ${minutes(total)}`, scan);
  }

  /** How far the mapping has come, and where loops were closed. */
  marks(length, head) {
    const canvas = $("marks"), width = canvas.clientWidth, height = canvas.clientHeight;
    const ratio = Math.min(devicePixelRatio || 1, 2), key = `${width},${length},${head},${this.model.events.length},${colour("bg")}`;
    if (!width || key === this.key) return;
    this.key = key;
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    const ctx = canvas.getContext("2d"), pad = 7, x = (t) => pad + (width - 2 * pad) * Math.min(t / length, 1);
    ctx.scale(ratio, ratio);
    const bar = (from, to, style) => {
      ctx.fillStyle = style;
      ctx.beginPath();
      ctx.roundRect(from, height / 2 - 3, Math.max(to - from, 1), 6, 3);
      ctx.fill();
    };
    bar(pad, width - pad, colour("line"));
    ctx.globalAlpha = 0.6;
    bar(pad, x(head), colour("accent"));
    ctx.globalAlpha = 0.8;
    ctx.fillStyle = colour("loop");
    for (const event of this.model.events) {
      if (event.what === "loop") ctx.fillRect(x(event.elapsed) - 0.75, height / 2 - 9, 1.5, 5);
    }
  }
}
