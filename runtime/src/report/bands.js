// State machines as bands of named states over time.

const ROW = 24;

function bandPanel(group) {
  const { chart, view } = group;
  const machines = chart.machines;
  const host = el("div", { class: "plot" });
  const height = machines.length * ROW + 36;
  const u = new uPlot(timeOptions(group, {
    scales: { y: { range: () => [0, machines.length] } },
    options: {
      width: 600, height, series: [{}, {}],
      axes: [axis({ size: 28 }), axis({ size: AXIS, splits: () => [], grid: { show: false } })],
    },
    hooks: { draw: [(u) => machines.forEach((machine, i) => drawBand(u, machine, i, chart.end))] },
  }), [[0, chart.end], [null, null]], host);
  const outputs = machines.map(() => el("output"));
  const legend = el("div", { class: "legend rows" }, ...machines.map((machine, i) => (
    el("div", { style: `height:${ROW}px` }, el("span", { class: "name", title: machine.states.join(", ") }, machine.name), outputs[i])
  )));
  view.on("cursor", () => machines.forEach((machine, i) => {
    outputs[i].textContent = view.cursor === null ? "" : machine.at(view.cursor);
  }));
  group.add(u, height);
  return el("div", { class: "panel" }, el("h4", {}, "states"), host, legend);
}

/** One machine: long stays first, so that short visits lie on top and stay visible. */
function drawBand(u, machine, row, end) {
  const { ctx, bbox } = u;
  const pxRatio = uPlot.pxRatio;
  const { min, max } = u.scales.x;
  const top = bbox.top + row * ROW * pxRatio + 2 * pxRatio;
  const height = (ROW - 4) * pxRatio;
  const runs = [];
  for (let i = Math.max(lastUpTo(machine.t, min), 0); i < machine.t.length && machine.t[i] < max; i++) {
    const from = u.valToPos(Math.max(machine.t[i], min), "x", true);
    const to = u.valToPos(Math.min(machine.t[i + 1] ?? end, max), "x", true);
    runs.push([from, Math.max(to - from, pxRatio), machine.s[i]]);
  }
  runs.sort((a, b) => b[1] - a[1]);
  ctx.save();
  ctx.font = `${11 * pxRatio}px system-ui, sans-serif`;
  ctx.textBaseline = "middle";
  ctx.textAlign = "center";
  for (const [from, width, state] of runs) {
    ctx.fillStyle = ink(state === 0 ? "band0" : `band${1 + (state - 1) % 7}`);
    ctx.fillRect(from, top, width, height);
    const name = machine.states[state];
    if (ctx.measureText(name).width + 8 * pxRatio < width) {
      ctx.fillStyle = ink("bandtext");
      ctx.fillText(name, from + width / 2, top + height / 2 + pxRatio);
    }
  }
  ctx.restore();
}
