// A performance: notes as bars over time, the strikes on them; speed and lateness over velocity.

const NAMES = ["C", "C♯", "D", "D♯", "E", "F", "F♯", "G", "G♯", "A", "A♯", "B"];
const noteName = (key) => `${NAMES[key % 12]}${Math.floor(key / 12) - 1}`;
const [KEY, ON, OFF, VELOCITY, STRIKE, SPEED, COUNT] = [0, 1, 2, 3, 4, 5, 6];

/** What a note is drawn with. */
const noteInk = (note, roll) => (note[STRIKE] === null ? "missed" : note[COUNT] > roll.usual ? "doubled" : "note");

function rollPanel(group, roll) {
  const { view } = group;
  const keys = roll.notes.map((note) => note[KEY]);
  const [low, high] = [Math.min(...keys) - 2, Math.max(...keys) + 2];
  const octaves = [];
  for (let key = Math.ceil(low / 12) * 12; key <= high; key += 12) octaves.push(key);
  const host = el("div", { class: "plot" });
  const height = 380;
  const u = new uPlot(timeOptions(group, {
    scales: { y: { range: () => [low, high] } },
    options: {
      width: 600, height, series: [{}, {}],
      axes: [axis({ size: 28 }), axis({ size: AXIS, splits: () => octaves, values: (u, splits) => splits.map(noteName) })],
    },
    hooks: { draw: [(u) => drawRoll(u, roll)] },
  }), [[0, roll.end], [null, null]], host);
  const readout = el("output", { class: "note" }, " ");
  u.over.addEventListener("mousemove", (event) => {
    const box = u.over.getBoundingClientRect();
    const [t, key] = [u.posToVal(event.clientX - box.left, "x"), Math.round(u.posToVal(event.clientY - box.top, "y"))];
    const slack = 4 * (view.to - view.from) / box.width;
    const note = roll.notes.find((n) => Math.abs(n[KEY] - key) < 1 && t >= n[ON] - slack && t <= Math.max(n[OFF], n[STRIKE] ?? 0) + slack);
    readout.textContent = note ? noteText(note) : " ";
  });
  group.add(u, height);
  const keysLine = el("p", { class: "keys" }, ...[["struck", "struck"], ["missed", "did not strike"], ["doubled", "struck more often"]].flatMap(
    ([colour, what]) => [el("span", { class: `swatch ${colour}` }), `${what} `]), readout);
  return el("div", { class: "panel loop" }, el("h4", {}, "notes and strikes"), host, keysLine);
}

function noteText(note) {
  const start = `${noteName(note[KEY])}, velocity ${note[VELOCITY]}, at ${note[ON].toFixed(3)} s`;
  if (note[STRIKE] === null) return `${start}: no strike`;
  const late = proper(((note[STRIKE] - note[ON]) * 1e3).toFixed(1));
  return `${start}: struck ${late} ms after note-on at ${note[SPEED].toFixed(2)} m/s${note[COUNT] > 1 ? `, ${note[COUNT]} times` : ""}`;
}

function drawRoll(u, roll) {
  const { ctx, bbox } = u;
  const pxRatio = uPlot.pxRatio;
  const { min, max } = u.scales.x;
  const row = Math.abs(u.valToPos(1, "y", true) - u.valToPos(0, "y", true));
  const tall = Math.max(2 * pxRatio, 0.8 * row);
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  const dots = [];
  for (const kind of ["note", "doubled", "missed"]) {
    ctx.fillStyle = ink(kind);
    for (const note of roll.notes) {
      if (noteInk(note, roll) !== kind || note[ON] > max || Math.max(note[OFF], note[STRIKE] ?? 0) < min) continue;
      const [x, y] = [u.valToPos(note[ON], "x", true), u.valToPos(note[KEY], "y", true)];
      ctx.globalAlpha = kind === "missed" ? 1 : 0.35 + 0.65 * note[VELOCITY] / 127;
      ctx.fillRect(x, y - tall / 2, Math.max(u.valToPos(note[OFF], "x", true) - x, 2 * pxRatio), tall);
      if (note[STRIKE] !== null) dots.push([u.valToPos(note[STRIKE], "x", true), y]);
    }
  }
  ctx.globalAlpha = 1;
  ctx.fillStyle = ink("text");
  const radius = Math.max(1, Math.min(3, row / 3)) * pxRatio;
  if (max - min < 60) {
    for (const [x, y] of dots) {
      ctx.beginPath();
      ctx.arc(x, y, radius, 0, 2 * Math.PI);
      ctx.fill();
    }
  }
  ctx.restore();
}

/** Points of one thing over velocity. */
function scatter(group, title, points) {
  const host = el("div", { class: "plot" });
  const ys = points.map(([, y]) => y).sort((a, b) => a - b);
  const u = new uPlot({
    width: 400, height: 260, legend: { show: false }, padding: [8, 12, 0, 0], cursor: { show: false },
    scales: { x: { time: false, range: () => [0, 128] }, y: { range: () => around(ys[0], ys[ys.length - 1]) } },
    series: [{}, {}], axes: [axis({ size: 40, label: "velocity", labelSize: 14, labelFont: "11px system-ui, sans-serif" }), axis({ size: AXIS })],
    hooks: { draw: [(u) => {
      const { ctx } = u;
      ctx.save();
      ctx.fillStyle = ink("note");
      ctx.globalAlpha = points.length > 500 ? 0.35 : 0.7;
      for (const [velocity, y] of points) {
        ctx.beginPath();
        ctx.arc(u.valToPos(velocity, "x", true), u.valToPos(y, "y", true), 2.2 * uPlot.pxRatio, 0, 2 * Math.PI);
        ctx.fill();
      }
      ctx.restore();
    }] },
  }, [[0, 1], [null, null]], host);
  group.onTheme(() => u.redraw(false));
  const panel = el("div", { class: "panel loop" }, el("h4", {}, title), host);
  new ResizeObserver(() => u.setSize({ width: Math.max(240, panel.clientWidth), height: 260 })).observe(panel);
  return panel;
}
