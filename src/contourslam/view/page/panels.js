// The texts and charts beside the map.

import { minutes } from "./charts.js";
import { laneColour, stageColour } from "./colours.js";
import { drawInnovations, drawLife } from "./corner_chart.js";
import { drawHealth } from "./health.js";
import { drawResponse, drawScan } from "./scan_chart.js";
import { drawSeries, honest, together } from "./series.js";

const $ = (id) => document.getElementById(id);
const TOGETHER = 8; // knots whose NIS is put together

const text = (tag, content, parent, more = {}) => {
  const node = Object.assign(document.createElement(tag), more);
  node.textContent = content;
  parent.append(node);
  return node;
};
const name = (lane) => lane.replaceAll("_", " ");
const angle = (rad) => {
  const degrees = Number((((rad * 180) / Math.PI + 540) % 360 - 180).toFixed(1));
  return `${(degrees || 0).toFixed(1)}°`; // zero has no sign
};

export function drawPanels(model, selected) {
  const { frame, about } = model, lanes = about.lanes;
  poses(model);
  $("scanfacts").textContent = `${frame.starts.length - 1} contours, ${frame.points.length / 2} points`;
  drawScan($("scan"), frame, about.mount);
  drawResponse($("response"), frame);
  const times = model.series("time", 0), all = lanes.map((_, i) => i);
  const nis = all.map((i) => together(model.series("nis", i), model.series("dof", i), TOGETHER));
  // Only a filter promises a NIS of 1: the contours' is against wheels that are taken for worse than they are.
  const band = about.back_end === "ekf" ? honest(nis.map(({ dof }) => dof)) : null;
  drawSeries($("nis"), times, nis.map(({ ratio }) => ratio), { band, log: [0.05, 20] });
  drawSeries($("sigma"), times, all.map((i) => model.series("sigma", i)), { factor: 100 });
  $("errorcard").hidden = !frame.truth;
  if (frame.truth) drawSeries($("error"), times, all.map((i) => model.series("error", i)), { factor: 100 });
  stages(model);
  corner(model, selected);
}

function poses(model) {
  const { frame, about } = model, body = $("pose").tBodies[0];
  $("errorhead").hidden = !frame.truth;
  body.replaceChildren(...frame.lanes.map((lane, i) => {
    const row = document.createElement("tr"), [x, y, a] = lane.pose, [xx, , yy, , , tt] = lane.covariance;
    const cell = (value, sigma) => text("small", sigma, text("td", value, row));
    const first = text("td", name(about.lanes[i]), row);
    first.style.color = laneColour(i);
    first.title = name(about.lanes[i]);
    text("small", lane.dof ? `NIS ${lane.nis.toFixed(1)} of ${lane.dof}` : "no correction", first);
    cell(x.toFixed(2), `±${(100 * Math.sqrt(xx)).toFixed(1)} cm`);
    cell(y.toFixed(2), `±${(100 * Math.sqrt(yy)).toFixed(1)} cm`);
    cell(angle(a), `±${(Math.sqrt(tt) * 180 / Math.PI).toFixed(2)}°`);
    if (frame.truth) {
      const turn = angle(a - frame.truth[2]);
      cell(`${(100 * Math.hypot(x - frame.truth[0], y - frame.truth[1])).toFixed(1)} cm`, turn);
    }
    return row;
  }));
}

function stages({ frame, about }) {
  const names = [...new Set(frame.lanes.flatMap((lane) => lane.stages.map(([stage]) => stage)))];
  const total = (lane) => lane.stages.reduce((sum, [, ms]) => sum + ms, 0);
  const most = Math.max(...frame.lanes.map(total), 1e-6), box = $("stages");
  box.replaceChildren();
  frame.lanes.forEach((lane, i) => {
    const row = text("div", "", box, { className: "stagerow" });
    text("span", name(about.lanes[i]), row).style.color = laneColour(i);
    const bar = text("div", "", row, { className: "bar" });
    for (const [stage, ms] of lane.stages) {
      const piece = text("i", "", bar, { title: `${stage}: ${ms.toFixed(3)} ms` });
      piece.style.width = `${(100 * ms) / most}%`;
      piece.style.background = stageColour(names.indexOf(stage));
    }
    text("span", total(lane).toFixed(2), row);
  });
  const keys = text("div", "", box, { className: "stagekeys" });
  names.forEach((stage, i) => {
    const key = text("span", "", keys);
    text("i", "", key).style.background = stageColour(i);
    key.append(stage);
  });
}

function corner(model, selected) {
  $("cornercard").hidden = !selected;
  if (!selected) return;
  const map = model.maps[selected.lane], at = map ? map.byId.get(selected.id) : undefined;
  $("cornerid").textContent = `${selected.id} of ${name(model.about.lanes[selected.lane])}`;
  const facts = $("cornerfacts");
  facts.replaceChildren();
  const fact = (label, value) => { text("dt", label, facts); text("dd", value, facts); };
  if (at === undefined) {
    fact("in the map", "not at this time");
  } else {
    const [a, , c] = map.covariances.subarray(3 * at, 3 * at + 3), o = map.observed[at], f = map.failed[at];
    fact("place", `${map.corners[2 * at].toFixed(3)}, ${map.corners[2 * at + 1].toFixed(3)} m`);
    fact("σ", `${(1000 * Math.sqrt(a)).toFixed(1)}, ${(1000 * Math.sqrt(c)).toFixed(1)} mm`);
    fact("shape", `${angle(map.openings[at])}, ${map.convex[at] ? "matter fills it" : "corner of a room"}`);
    fact("seen, o", o);
    fact("missed, f", f);
    fact("f / (f + o)", o + f ? (f / (o + f)).toFixed(3) : "–");
  }
  const story = model.story;
  if (!story || story.id !== selected.id || story.lane !== selected.lane) return;
  drawLife($("cornerhistory"), story, model.frame.elapsed, model.about.max_false_negative_rate);
  drawInnovations($("cornerinnovations"), story, model.frame.elapsed);
}

/** What the server says of itself. */
export function drawStatus(model, seek) {
  const { status, about } = model;
  drawHealth(model);
  const words = {
    starting: [about.live ? "waiting for a scan" : "starting", "busy"], mapping: ["mapping", "busy"],
    refining: ["refining the map", "busy"], finished: ["mapped to the end", "good"], failed: ["failed", "bad"],
    live: ["live", "good"], lost: ["looking for the robot", "bad"],
  };
  let [word, tone] = words[status.state] || [status.state, ""];
  if (about.live && status.at !== null) [word, tone] = [status.paused ? "held" : "looking back", ""];
  else if (status.paused && status.state !== "finished") [word, tone] = ["paused", ""];
  if (status.hurries_to !== null) [word, tone] = ["mapping ahead", "busy"];
  $("state").textContent = word;
  $("state").dataset.tone = tone;
  $("trouble").hidden = !status.trouble;
  $("trouble").textContent = status.trouble;
  if (model.newEvents.length) events(model, seek);
}

function events(model, seek) {
  const list = $("events");
  for (const event of model.newEvents) {
    const item = document.createElement("li");
    text("span", "", item, { className: `mark ${event.what}` });
    text("button", minutes(event.elapsed), item, { type: "button", title: "Look at this moment" })
      .addEventListener("click", () => seek(event.elapsed));
    const lane = event.lane !== undefined && model.lanes > 1 ? `${name(model.about.lanes[event.lane])}: ` : "";
    text("span", lane + event.text, item);
    list.prepend(item);
  }
  while (list.children.length > 200) list.lastChild.remove();
}
