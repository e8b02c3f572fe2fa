// How all is: figures of the mapping and of the page, and of a robot what each part says, worst first.

const $ = (id) => document.getElementById(id);
const ORDER = ["error", "warning", "ok"], SIGNS = { error: "✕", warning: "!", ok: "✓" };
const rows = new Map(); // of each diagnostic its row, so that one that was opened stays open

const text = (tag, content, parent, more = {}) => {
  const node = Object.assign(document.createElement(tag), more);
  node.textContent = content;
  parent.append(node);
  return node;
};

export function drawHealth(model) {
  const { status, about } = model, facts = $("health");
  facts.replaceChildren();
  const fact = (label, value, tone = "") => { text("dt", label, facts); text("dd", value, facts).dataset.tone = tone; };
  fact("scans", `${status.scans}`);
  if (!about.live) speed(status, fact);
  fact("beams that returned", status.beams ? `${status.returned} of ${status.beams}` : "–");
  const { median, most } = status.lag;
  fact("page behind mapping", median === null ? "–" : `${median.toFixed(0)} ms, at most ${most.toFixed(0)} ms`,
    median > 500 ? "bad" : "good");
  fact("pages open", status.pages);
  if (about.live) diagnostics(status.health);
}

function speed(status, fact) {
  const behind = !status.paused && status.state === "mapping" && status.speed !== null && status.reached > 0
    && status.reached < 0.85 * status.speed;
  fact("scans a second", status.scan_rate.toFixed(1));
  fact("speed", `${status.reached.toFixed(1)}×${behind ? ` of ${status.speed}×` : ""}`, behind ? "bad" : "");
}

function diagnostics(health) {
  const worst = [...health].sort((a, b) => ORDER.indexOf(a.level) - ORDER.indexOf(b.level));
  const shown = worst.map((one) => {
    let row = rows.get(one.name);
    if (!row) rows.set(one.name, row = makeRow(one.name));
    fill(row, one);
    return row.item;
  });
  const list = $("diagnostics");
  if (shown.length !== list.children.length || shown.some((item, i) => list.children[i] !== item)) {
    list.replaceChildren(...shown);
  }
}

function makeRow(name) {
  const item = document.createElement("li"), details = text("details", "", item), summary = text("summary", "", details);
  const sign = text("span", "", summary, { className: "sign" });
  const line = text("span", "", summary);
  text("b", name, line);
  return { item, sign, message: text("span", "", line), values: text("dl", "", details, { className: "facts" }), known: "" };
}

function fill(row, { level, message, values }) {
  const known = JSON.stringify([level, message, values]);
  if (known === row.known) return;
  row.known = known;
  row.item.dataset.level = level;
  row.sign.textContent = SIGNS[level];
  row.sign.setAttribute("role", "img");
  row.sign.setAttribute("aria-label", level);
  row.message.textContent = ` ${message}`;
  row.values.replaceChildren();
  for (const [label, value] of Object.entries(values)) {
    text("dt", label, row.values);
    text("dd", value, row.values);
  }
}
