// Force over travel: the whole run faintly, what is in view on top of it, down and up in two colours.

function loopPanel(group) {
  const { chart, view } = group;
  const [travel, total] = [chart.columns[chart.travel], chart.columns[chart.total]];
  const [moved, felt] = [chart.panels[0].title, chart.panels[1].title];
  const times = union([travel, total]);
  const [xs, ys] = [travel.sample(times), total.sample(times)];
  const measured = measuredLoop(chart, travel, total);
  const host = el("div", { class: "plot" });
  const u = new uPlot({
    width: 480, height: 360, legend: { show: false }, padding: [8, 12, 0, 0],
    cursor: { drag: { x: false, y: false }, points: { show: false } },
    scales: { x: { time: false, range: () => around(...extent([xs, ...measured.map((branch) => branch.x)])) }, y: { range: () => around(...extent([ys, ...measured.map((branch) => branch.y)])) } },
    series: [{}, {}],
    axes: [
      axis({ size: 40, label: `${moved} (${travel.unit})`, labelSize: 14, labelFont: "11px system-ui, sans-serif" }),
      axis({ size: AXIS }),
    ],
    hooks: { draw: [(u) => (drawMeasured(u, measured), drawLoop(u, times, xs, ys, view))] },
  }, [[0, 1], [null, null]], host);
  const dot = el("div", { class: "dot" });
  u.over.append(dot);
  const readout = el("output");
  view.on("cursor", () => {
    const t = view.cursor;
    const [x, y] = t === null ? [NaN, NaN] : [travel.at(t), total.at(t)];
    dot.hidden = Number.isNaN(x);
    readout.textContent = dot.hidden ? "" : `${travel.text(x)} ${travel.unit}, ${total.text(y)} ${total.unit}`;
    if (!dot.hidden) dot.style.transform = `translate(${u.valToPos(x, "x")}px, ${u.valToPos(y, "y")}px)`;
  });
  view.on("range", () => requestAnimationFrame(() => u.redraw(false)));
  group.onTheme(() => u.redraw(false));
  const keys = el("p", { class: "keys" },
    el("span", { class: "swatch down" }), moved === "angle" ? "turning up " : "key going down ", el("span", { class: "swatch up" }), moved === "angle" ? "turning back " : "key coming up ",
    ...measured.flatMap(({ ink: colour, name }) => [el("span", { class: `swatch ${colour}` }), `${name} `]), readout);
  const panel = el("div", { class: "panel loop" }, el("h4", {}, `${felt} over ${moved} (${total.unit})`), host, keys);
  new ResizeObserver(() => u.setSize({ width: Math.max(240, panel.clientWidth), height: 360 })).observe(panel);
  return panel;
}

/** What was measured, each branch in the units shown; nothing where nothing was. */
function measuredLoop(chart, travel, total) {
  if (!chart.measured) return [];
  const branch = ({ x, y }, ink, name) => ({ x: floats(x).map((v) => v * travel.factor), y: floats(y).map((v) => v * total.factor), ink, name });
  return [branch(chart.measured.press, "measured-down", "measured, down"), branch(chart.measured.back, "measured-up", "measured, up")];
}

function drawMeasured(u, measured) {
  const { ctx } = u;
  ctx.save();
  ctx.beginPath();
  ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
  ctx.clip();
  ctx.lineJoin = "round";
  ctx.lineWidth = 4 * uPlot.pxRatio;
  for (const branch of measured) {
    ctx.strokeStyle = ink(branch.ink);
    ctx.beginPath();
    branch.x.forEach((x, i) => ctx.lineTo(u.valToPos(x, "x", true), u.valToPos(branch.y[i], "y", true)));
    ctx.stroke();
  }
  ctx.restore();
}

function drawLoop(u, times, xs, ys, view) {
  const { ctx } = u;
  const pxRatio = uPlot.pxRatio;
  const place = (i) => [u.valToPos(xs[i], "x", true), u.valToPos(ys[i], "y", true)];
  const stroke = (colour, width, from, to, wanted) => {
    ctx.strokeStyle = colour;
    ctx.lineWidth = width * pxRatio;
    ctx.beginPath();
    let pen = false;
    for (let i = from; i < to; i++) {
      if (wanted && !wanted(xs[i + 1] - xs[i])) {
        pen = false;
        continue;
      }
      if (!pen) ctx.moveTo(...place(i));
      ctx.lineTo(...place(i + 1));
      pen = true;
    }
    ctx.stroke();
  };
  ctx.save();
  ctx.beginPath();
  ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
  ctx.clip();
  ctx.lineJoin = "round";
  if (!view.whole) stroke(ink("faint"), 1, 0, times.length - 1);
  const [from, to] = [Math.max(lastUpTo(times, view.from), 0), Math.min(lastUpTo(times, view.to) + 1, times.length - 1)];
  stroke(ink("up"), 1.5, from, to, (step) => step < 0);
  stroke(ink("down"), 1.5, from, to, (step) => step >= 0);
  ctx.restore();
}
