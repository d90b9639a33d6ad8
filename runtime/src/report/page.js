// From sections of plain HTML to live ones: plots when a section is first shown, keys, colours, paper.

const live = new Map();

function dataOf(kind, id) {
  const script = document.getElementById(`${kind}-${id}`);
  return script && JSON.parse(script.textContent);
}

/** The plots of a run. */
function chartOf(host, id) {
  const chart = unpack(dataOf("chart", id));
  const view = new View(chart.start, chart.end, 32 / chart.rate_hz);
  const group = new Group(id, chart, view);
  const stack = el("div", { class: "stack", tabindex: "0", role: "group", "aria-label": "Plots over time" });
  const last = chart.machines.length > 0 ? -1 : chart.panels.length - 1;
  chart.panels.forEach((panel, at) => stack.append(linePanel(group, panel, at, at === last)));
  if (chart.machines.length > 0) stack.append(bandPanel(group));
  stack.addEventListener("keydown", (event) => onKey(event, group));
  host.append(toolbar(group), stack);
  sized(group, stack);
  if (chart.travel !== null && chart.total !== null) {
    const pair = el("div", { class: "pair" }, loopPanel(group));
    host.append(pair);
    const events = host.closest("section").querySelector(".table");
    if (events) pair.append(events);
  }
  return group;
}

/** Keeps plots as wide as there is room. */
function sized(group, stack) {
  const fit = () => {
    const plot = stack.querySelector(".plot");
    if (plot && plot.clientWidth > 0) group.resize(Math.max(240, plot.clientWidth));
  };
  new ResizeObserver(fit).observe(stack);
  fit();
}

function toolbar(group) {
  const { view } = group;
  const button = (text, title, act) => el("button", { type: "button", title, onclick: act }, text);
  const range = el("output");
  const cursor = el("output", { class: "at" });
  const digits = () => Math.min(7, Math.max(2, 4 - Math.floor(Math.log10(view.to - view.from))));
  view.on("range", () => {
    range.textContent = `${view.from.toFixed(digits())} – ${view.to.toFixed(digits())} s`;
  });
  view.on("cursor", () => (cursor.textContent = view.cursor === null ? "" : `at ${view.cursor.toFixed(digits())} s`));
  const fit = el("input", { type: "checkbox" });
  fit.addEventListener("change", () => {
    view.fit = fit.checked;
    view.tell("range");
  });
  return el("div", { class: "toolbar" },
    button("◀", "earlier (arrow left)", () => view.pan(-0.25)), button("▶", "later (arrow right)", () => view.pan(0.25)),
    button("+", "closer (+)", () => view.zoom(0.5)), button("−", "further (−)", () => view.zoom(2)),
    button("whole", "everything (0, or double click)", () => view.reset()),
    button(`◁ ${group.stop}`, `the ${group.stop} before (p)`, () => toStop(group, -1)),
    button(`${group.stop} ▷`, `the next ${group.stop} (n)`, () => toStop(group, 1)),
    group.stop === "strike" ? el("label", {}, fit, " fit heights") : "", range, cursor,
    el("details", { class: "help" }, el("summary", {}, "mouse and keys"), el("p", {},
      `Drag to choose a part; shift-drag moves; the wheel zooms once you have clicked into the plots, or with Ctrl; double click shows ` +
      `everything. Keys: arrows move, + and − zoom, 0 everything, n and p the next and previous ${group.stop}, shift with arrows moves the crosshair. Legends hide and ` +
      `show lines, shift-click leaves one alone.`)));
}

/** Shows a little time around the next, or previous, strike or fault, seen from the middle. */
function toStop(group, step) {
  const { view, stops } = group;
  const middle = view.cursor ?? (view.whole ? (step > 0 ? -1 : Infinity) : (view.from + view.to) / 2);
  const apart = 1e-6;
  const next = step > 0
    ? stops.find(([t]) => t > middle + apart)
    : stops.findLast(([t]) => t < middle - apart);
  if (next) showInstant(group, next[0]);
}

/** Shows an instant in the middle of a little time. */
function showInstant(group, t) {
  const half = Math.min(group.stop === "strike" ? 0.1 : 2, (group.view.to - group.view.from) / 2);
  group.view.show(t - half, t + half);
  group.point(t);
}

function onKey(event, group) {
  if (event.ctrlKey || event.altKey || event.metaKey || event.target.closest("button, input")) return;
  const { view } = group;
  const step = (view.to - view.from) / 200;
  const move = (by) => group.point(Math.min(view.to, Math.max(view.from, (view.cursor ?? (view.from + view.to) / 2) + by)));
  const keys = {
    ArrowLeft: () => (event.shiftKey ? move(-step) : view.pan(-0.1)),
    ArrowRight: () => (event.shiftKey ? move(step) : view.pan(0.1)),
    "+": () => view.zoom(0.7), "=": () => view.zoom(0.7), "-": () => view.zoom(1 / 0.7), "_": () => view.zoom(1 / 0.7),
    "0": () => view.reset(), Home: () => view.reset(), n: () => toStop(group, 1), p: () => toStop(group, -1),
    Escape: () => event.currentTarget.blur(),
  };
  if (!keys[event.key]) return;
  event.preventDefault();
  keys[event.key]();
}

/** The plots of a performance. */
function rollOf(host, id) {
  const roll = dataOf("keys", id);
  const view = new View(0, roll.end, 0.01);
  const faults = roll.notes.filter((note) => noteInk(note, roll) !== "note");
  const group = new Group(id, { marks: [] }, view);
  group.stops = faults.map((note) => [note[ON]]);
  group.stop = "fault";
  const stack = el("div", { class: "stack", tabindex: "0", role: "group", "aria-label": "Notes over time" }, rollPanel(group, roll));
  stack.addEventListener("keydown", (event) => onKey(event, group));
  host.append(toolbar(group), stack);
  sized(group, stack);
  const struck = roll.notes.filter((note) => note[STRIKE] !== null);
  if (struck.length > 0) {
    host.append(el("div", { class: "pair" },
      scatter(group, "speed of the strike (m/s) over velocity", struck.map((note) => [note[VELOCITY], note[SPEED]])),
      scatter(group, "from note-on to the strike (ms) over velocity", struck.map((n) => [n[VELOCITY], (n[STRIKE] - n[ON]) * 1e3]))));
  }
  return group;
}

const makers = { chart: chartOf, keys: rollOf, strings: stringsOf };

/** Brings a section to life, once. */
function enliven(section) {
  if (live.has(section.id)) return;
  live.set(section.id, []);
  for (const host of section.querySelectorAll(".plots")) {
    live.get(section.id).push(makers[host.dataset.kind](host, section.id));
  }
  const first = live.get(section.id)[0];
  section.querySelectorAll("table").forEach((table) => liveTable(table, (row) => {
    showInstant(first, Number(row.dataset.t));
    section.querySelector(".toolbar").scrollIntoView({ block: "nearest" });
  }));
}

const sections = [...document.querySelectorAll("main > section")];

/** Shows the section the address names, else the first. */
function route() {
  const id = decodeURIComponent(location.hash.slice(1));
  const wanted = sections.find((section) => section.id === id) ?? sections[0];
  sections.forEach((section) => (section.hidden = section !== wanted));
  document.querySelectorAll("nav a").forEach((a) => {
    if (a.hash === `#${wanted?.id}`) a.setAttribute("aria-current", "page");
    else a.removeAttribute("aria-current");
  });
  if (wanted) enliven(wanted);
}

/** Light or dark: as the system has it, until somebody chooses. */
function paint(theme) {
  document.documentElement.dataset.theme = theme;
  for (const groups of live.values()) groups.forEach((group) => group.theme());
}

const system = matchMedia("(prefers-color-scheme: dark)");
const wished = () => (system.matches ? "dark" : "light");
system.addEventListener("change", () => paint(wished()));
document.querySelector("header.top").prepend(el("button", {
  type: "button", class: "theme", title: "light or dark", "aria-label": "light or dark",
  onclick: () => paint(document.documentElement.dataset.theme === "dark" ? "light" : "dark"),
}, "◐"));

// Paper is white.
let before;
addEventListener("beforeprint", () => {
  before = document.documentElement.dataset.theme;
  paint("light");
});
addEventListener("afterprint", () => paint(before));
paint(wished());

document.querySelectorAll("header.top table").forEach((table) => liveTable(table, (row) => {
  location.hash = row.dataset.section;
}));
addEventListener("hashchange", route);
route();
