// The page: takes what the server sends, and draws the newest of it.

import { Camera } from "./camera.js";
import { colour, forgetColours } from "./colours.js";
import { liftOf } from "./landmarks.js";
import { Link } from "./link.js";
import { LAYERS, LaneMap } from "./map.js";
import { Model } from "./model.js";
import { drawPanels, drawStatus } from "./panels.js";
import { Transport } from "./transport.js";

const $ = (id) => document.getElementById(id);
const PANELS = 200; // ms between two drawings of what stands beside the map
const store = {
  get: (key, otherwise) => { try { return localStorage.getItem(key) ?? otherwise; } catch { return otherwise; } },
  set: (key, value) => { try { localStorage.setItem(key, value); } catch { /* private windows have no store */ } },
};

const model = new Model();
const camera = new Camera(() => { toolbar(); ask(); });
const layers = Object.fromEntries(LAYERS.map(([key, , , on]) => [key, store.get(`layer.${key}`, String(on)) === "true"]));
let maps = [], selected = null, undrawn = null, drawn = null, asked = false, panelsAt = 0, panelsWait = null, statusNew = false, mapNumber;

const link = new Link({
  message(message) {
    model.take(message);
    if (message.kind === "hello") hello();
    if (message.kind === "frame") undrawn = message.index;
    if (message.kind === "status") statusNew = true;
    ask();
  },
  opened() { $("link").dataset.on = "yes"; $("link").title = "connected"; },
  closed() {
    $("link").dataset.on = "no";
    $("link").title = "not connected; trying again";
    $("state").textContent = "not connected";
    $("state").dataset.tone = "bad";
  },
});
const send = (...request) => link.send(...request);
const transport = new Transport(model, send);

/** The connection is new, or another map is begun: all that is known is sent again. */
function hello() {
  const { about } = model;
  undrawn = null; // the frame is forgotten, and the server waits for it no longer
  $("title").textContent = `${about.title} · ${about.back_end === "ekf" ? "EKF" : about.back_end}`;
  document.title = `${about.title} – contourslam`;
  $("waiting").hidden = false;
  if (about.live) {
    $("waiting").textContent = "Nothing has been mapped yet; Health says what is missing.";
    $("posecard").before($("healthcard"));
  }
  transport.begin(about.live);
  const same = maps.map((map) => map.name).join() === about.lanes.join();
  if (!same || about.map !== mapNumber) selected = null;
  mapNumber = about.map;
  if (!same) {
    maps = about.lanes.map((name, lane) => new LaneMap(lane, name, camera, choose));
    $("lanes").replaceChildren(...maps.map((map) => map.figure));
    $("lanes").dataset.count = $("stage").dataset.count = maps.length;
    maps.forEach((map) => resized.observe(map.canvas));
  }
  maps.forEach((map) => map.forget());
  model.events = [];
  $("events").replaceChildren();
  send("story", selected ? selected.id : -1, { lane: selected ? selected.lane : 0 });
}

/** Draw at the next chance. */
function ask() {
  if (asked) return;
  asked = true;
  requestAnimationFrame(draw);
}

function draw(now) {
  asked = false;
  if (statusNew && model.status) {
    statusNew = false;
    for (const event of model.newEvents) {
      if (event.what === "loop" && model.frame && Math.abs(event.elapsed - model.frame.elapsed) < 60) {
        maps[event.lane]?.flash(event.x, event.y);
      }
    }
    drawStatus(model, (time) => send("seek", time));
    model.newEvents = [];
  }
  if (!model.about || !model.frame) return;
  waiting();
  if (camera.mode === "follow") [camera.x, camera.y] = model.frame.lanes[0].pose;
  if (camera.mode === "fit") camera.fit(maps[0].box(model), maps[0].canvas.clientWidth, maps[0].canvas.clientHeight);
  let moving = false;
  for (const map of maps) moving = map.draw(model, layers, selected) || moving;
  legend();
  transport.draw();
  if (now - panelsAt > PANELS) {
    panelsAt = now;
    drawPanels(model, selected);
    for (const map of maps) map.describe(model);
  } else {
    panelsWait ??= setTimeout(() => { panelsWait = null; ask(); }, PANELS + 5 - (now - panelsAt));
  }
  if (undrawn !== null) {
    send("drawn", undrawn);
    drawn = undrawn;
    undrawn = null;
  }
  if (moving) ask();
}

/** What stands over the map where it cannot say more: that the robot has not been found in it. */
function waiting() {
  const lost = model.frame.lanes.some((lane) => !lane.localized);
  $("waiting").hidden = !lost;
  if (lost) $("waiting").textContent = "The robot is not found in the map yet: drive it to where it sees walls and corners.";
}

/** What the lines on the map are, of those that are shown. */
function legend() {
  const lift = liftOf(model.maps, camera.scale), truth = Boolean(model.frame.truth), loops = model.maps.some((map) => map && map.loop_methods.length);
  const entries = [
    [layers.walls, "line", "wall", "walls"],
    [layers.corners, "ring", "corner", `corners, 3σ${lift > 1 ? `, ${lift} times larger` : ""}`],
    [layers.path, "line", "lane0", "trajectory"],
    [layers.truth && truth, "dash", "truth", "true trajectory"],
    [layers.odometry, "line", "raw", "raw odometry"],
    [layers.loops && loops, "line", "loop", "ties to earlier places"],
    [layers.pairs, "line", "good", "recognised now"],
    [layers.response, "line", "bad", "detector response"],
  ].filter(([on]) => on);
  const key = entries.map(([, , , words]) => words).join();
  if ($("legend").dataset.key === key) return;
  $("legend").dataset.key = key;
  $("legend").replaceChildren(...entries.map(([, kind, tint, words]) => {
    const entry = document.createElement("li"), sign = document.createElement("i");
    sign.className = kind;
    sign.style.setProperty("--c", `var(--${tint})`);
    entry.append(sign, words);
    return entry;
  }));
}

/** A tap on a map: the corner there, or none; `reach` is how far away it may be, in pixels. */
function choose(lane, point, reach) {
  const id = maps[lane].cornerAt(model, point, reach);
  select(id < 0 ? null : { lane, id });
}

function select(corner) {
  selected = corner;
  send("story", corner ? corner.id : -1, { lane: corner ? corner.lane : 0 });
  model.story = null;
  panelsAt = 0;
  if (corner) $("side").scrollTop = 0;
  ask();
}

function toolbar() {
  $("fit").setAttribute("aria-pressed", camera.mode === "fit");
  $("follow").setAttribute("aria-pressed", camera.mode === "follow");
}

const resized = new ResizeObserver(ask);

for (const [key, label, tint] of LAYERS) {
  const row = document.createElement("label"), box = document.createElement("input"), line = document.createElement("i");
  Object.assign(box, { type: "checkbox", checked: layers[key] });
  box.dataset.layer = key;
  line.style.setProperty("--c", `var(--${tint})`);
  box.onchange = () => {
    layers[key] = box.checked;
    store.set(`layer.${key}`, box.checked);
    ask();
  };
  row.append(box, line, label);
  $("layerlist").append(row);
}

function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  forgetColours();
  ask();
}
const system = matchMedia("(prefers-color-scheme: dark)");
const theme = () => store.get("theme", system.matches ? "dark" : "light");
system.addEventListener("change", () => setTheme(theme()));
$("theme").onclick = () => {
  store.set("theme", document.documentElement.dataset.theme === "dark" ? "light" : "dark");
  setTheme(theme());
};
setTheme(theme());

$("fit").onclick = () => camera.setMode("fit");
$("follow").onclick = () => {
  camera.scale = Math.max(camera.scale, 45);
  camera.setMode("follow");
};
$("closer").onclick = () => camera.zoom(1.4);
$("wider").onclick = () => camera.zoom(1 / 1.4);
$("cornerclose").onclick = () => select(null);
$("goto").onchange = () => {
  const id = Number($("goto").value);
  const lane = model.maps.findIndex((map) => map && map.byId.has(id));
  if ($("goto").value === "" || lane < 0) return;
  const at = model.maps[lane].byId.get(id);
  camera.mode = "free";
  [camera.x, camera.y] = model.maps[lane].corners.subarray(2 * at, 2 * at + 2);
  camera.scale = Math.max(camera.scale, 60);
  toolbar();
  select({ lane, id });
};

/** A key while a map has the focus: true where it means something there. */
function keyOnMap(lane, key) {
  const step = { ArrowLeft: [60, 0], ArrowRight: [-60, 0], ArrowUp: [0, 60], ArrowDown: [0, -60] }[key];
  if (step) camera.shift(...step);
  else if (key === "Enter") choose(lane, [0, 0], Infinity);
  return Boolean(step) || key === "Enter";
}

document.addEventListener("keydown", (event) => {
  if (event.target.closest("input, select, textarea") || event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === " " && event.target.closest("button, summary")) return;
  if (event.target.dataset.lane !== undefined && keyOnMap(Number(event.target.dataset.lane), event.key)) {
    event.preventDefault();
    return;
  }
  const keys = {
    " ": () => transport.toggle(),
    ArrowLeft: () => send("step", event.shiftKey ? -10 : -1),
    ArrowRight: () => send("step", event.shiftKey ? 10 : 1),
    f: () => $("follow").click(),
    0: () => $("fit").click(),
    "+": () => $("closer").click(),
    "-": () => $("wider").click(),
    Escape: () => select(null),
  };
  const act = keys[event.key];
  if (!act) return;
  event.preventDefault();
  act();
});

// For those who test the page.
window.contourslam = { model, camera, link, get drawn() { return drawn; }, get selected() { return selected; }, get maps() { return maps; } };
