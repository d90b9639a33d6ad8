// Lines over time, one panel per unit, by uPlot; legends that switch lines and read out values; what a mouse, fingers and keys do.

const AXIS = 58;
const el = (tag, attributes = {}, ...children) => {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value !== false) node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children);
  return node;
};

/** A colour of the style sheet. */
const ink = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const lineInk = (i) => ink(`line${i % 9}`);

/** Labels with just the decimals that tell ticks of an axis apart. */
const axisLabels = (u, splits) => {
  const step = splits.length > 1 ? splits[1] - splits[0] : 1;
  let decimals = 0;
  while (decimals < 9 && Math.abs(step * 10 ** decimals - Math.round(step * 10 ** decimals)) > 1e-6 * step * 10 ** decimals) decimals++;
  return splits.map((v) => proper(v.toFixed(decimals)));
};

const axis = (more) => ({
  stroke: () => ink("soft"), font: "11px system-ui, sans-serif", values: axisLabels,
  grid: { stroke: () => ink("grid"), width: 1 }, ticks: { stroke: () => ink("grid"), width: 1, size: 4 }, ...more,
});

/** The smallest and greatest of some values, with a little room. */
function around(low, high) {
  if (!(low <= high)) return [0, 1];
  const room = high > low ? 0.06 * (high - low) : Math.max(0.5 * Math.abs(high), 0.5);
  return [low - room, high + room];
}

function extent(arrays) {
  let low = Infinity, high = -Infinity;
  for (const values of arrays) {
    for (const v of values) {
      if (v < low) low = v;
      if (v > high) high = v;
    }
  }
  return [low, high];
}

/** What all plots over time share: the range, the crosshair, dragging. */
function timeOptions(group, more) {
  const { view } = group;
  return {
    legend: { show: false },
    scales: { x: { time: false, range: () => [view.from, view.to] }, ...more.scales },
    cursor: {
      y: false, points: { show: more.points ?? false }, drag: { x: true, y: false, setScale: false, dist: 4 },
      sync: { key: group.key, scales: ["x", null], setSeries: false },
      bind: { dblclick: () => () => view.reset() },
    },
    padding: [more.top ?? 6, 8, 0, 0],
    ...more.options,
    hooks: {
      drawAxes: [(u) => drawMarks(u, group, more.labels)],
      setCursor: [(u) => view.point(u.cursor.left < 0 ? null : u.posToVal(u.cursor.left, "x"))],
      setSelect: [(u) => {
        const { left, width } = u.select;
        if (width < 4) return;
        view.show(u.posToVal(left, "x"), u.posToVal(left + width, "x"));
        u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
      }],
      ...more.hooks,
    },
  };
}

/** Strikes as lines through a plot, with their labels where there is room. */
function drawMarks(u, group, labels) {
  const { ctx, bbox } = u;
  const pxRatio = uPlot.pxRatio;
  ctx.save();
  ctx.strokeStyle = ink("mark");
  ctx.fillStyle = ink("soft");
  ctx.font = `${11 * pxRatio}px system-ui, sans-serif`;
  ctx.textAlign = "center";
  ctx.lineWidth = pxRatio;
  let free = -Infinity;
  for (const [t, label] of group.marks) {
    if (t < u.scales.x.min || t > u.scales.x.max) continue;
    const x = Math.round(u.valToPos(t, "x", true)) + 0.5;
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
    const half = ctx.measureText(label).width / 2 + 3 * pxRatio;
    if (labels && x - half > free) {
      ctx.fillText(label, x, bbox.top - 4 * pxRatio);
      free = x + half;
    }
  }
  ctx.restore();
}

/** One panel of lines: its plot and its legend; the last of all has the labels of time. */
function linePanel(group, panel, at, last) {
  const { chart, view } = group;
  const columns = panel.columns.map((i) => chart.columns[i]);
  const total = panel.columns.indexOf(chart.total);
  const times = union(columns);
  const values = columns.map((column) => column.sample(times));
  const colour = (i) => (i === total && columns.length > 1 ? ink("text") : lineInk(i));
  const shown = columns.map(() => true);
  const range = () => {
    const visible = values.filter((_, i) => shown[i]);
    if (!view.fit) return around(...extent(visible));
    const [first, last] = [Math.max(lastUpTo(times, view.from), 0), lastUpTo(times, view.to) + 2];
    return around(...extent(visible.map((v) => v.subarray(first, last))));
  };
  const series = columns.map((column, i) => ({
    label: column.name, stroke: () => colour(i), width: i === total ? 1.8 : 1.4, pxAlign: 0, points: { show: false },
  }));
  const host = el("div", { class: "plot" });
  const height = (columns.length > 3 ? 240 : 150) + (last ? 22 : 0);
  const u = new uPlot(timeOptions(group, {
    points: true, labels: at === 0, top: at === 0 ? 18 : 8, scales: { y: { range } },
    options: {
      width: 600, height, series: [{}, ...series],
      axes: [axis(last ? { size: 28 } : { size: 6, values: (u, splits) => splits.map(() => "") }), axis({ size: AXIS })],
    },
  }), [times, ...values], host);
  const legend = el("div", { class: "legend" });
  const outputs = columns.map((column, i) => {
    const output = el("output", {}, "");
    const swatch = el("span", { class: "swatch" });
    const toggle = (event) => {
      const alone = event.shiftKey || event.altKey;
      columns.forEach((_, k) => (shown[k] = alone ? k === i : k === i ? !shown[k] : shown[k]));
      u.batch(() => shown.forEach((on, k) => u.setSeries(k + 1, { show: on })));
      [...legend.children].forEach((button, k) => button.setAttribute("aria-pressed", shown[k]));
    };
    const title = column.every
      ? `extremes of every ${column.every} ticks are exact`
      : `drawn within ${(column.within * column.factor).toPrecision(2)} ${column.unit}; click: hide or show, shift-click: alone`;
    const name = el("span", { class: "name" }, column.name);
    legend.append(el("button", { type: "button", "aria-pressed": "true", title, onclick: toggle }, swatch, name, output));
    group.onTheme(() => (swatch.style.background = colour(i)));
    return output;
  });
  view.on("cursor", () => {
    columns.forEach((column, i) => {
      const text = view.cursor === null ? "" : `${column.text(column.at(view.cursor))} ${column.unit}`;
      if (outputs[i].textContent !== text) outputs[i].textContent = text;
    });
  });
  group.add(u, height);
  const heading = el("h4", {}, panel.unit ? `${panel.title} (${panel.unit})` : panel.title);
  return el("div", { class: "panel" }, heading, host, legend);
}

/** The plots of a section that share a view: they are resized, redrawn and pointed at together. */
class Group {
  constructor(key, chart, view) {
    Object.assign(this, { key, chart, view, marks: chart.marks, stops: chart.marks, stop: "strike", plots: [], themed: [] });
    let due = false;
    view.on("range", () => {
      if (due) return;
      due = true;
      requestAnimationFrame(() => {
        due = false;
        this.redraw();
      });
    });
  }

  add(u, height) {
    this.plots.push([u, height]);
    this.listen(u.over);
  }

  redraw() {
    for (const [u] of this.plots) {
      u.setScale("x", { min: this.view.from, max: this.view.to });
      u.redraw(true, true);
    }
  }

  resize(width) {
    for (const [u, height] of this.plots) {
      if (u.width !== width) u.setSize({ width, height });
    }
  }

  onTheme(act) {
    this.themed.push(act);
    act();
  }

  theme() {
    this.themed.forEach((act) => act());
    this.redraw();
  }

  /** Puts the crosshair of all plots somewhere. */
  point(t) {
    const { view } = this;
    const part = (t - view.from) / (view.to - view.from);
    for (const [u] of this.plots) u.setCursor({ left: part * u.over.clientWidth, top: 0 }, false);
    view.point(t);
  }

  listen(over) {
    const { view } = this;
    const timeAt = (event) => {
      const box = over.getBoundingClientRect();
      return view.from + (view.to - view.from) * (event.clientX - box.left) / box.width;
    };
    over.addEventListener("wheel", (event) => {
      const stack = over.closest(".stack");
      // A page must be able to scroll past its plots: the wheel is theirs once they were clicked, or with Ctrl.
      if (!(event.ctrlKey || event.metaKey || stack.contains(document.activeElement))) return;
      event.preventDefault();
      const sideways = event.shiftKey ? event.deltaY : event.deltaX;
      if (Math.abs(sideways) > Math.abs(event.shiftKey ? 0 : event.deltaY)) view.pan(sideways / 1000);
      else view.zoom(Math.exp(Math.max(-300, Math.min(300, event.deltaY)) / 400), timeAt(event));
    }, { passive: false });
    over.addEventListener("mousedown", (event) => {
      over.closest(".stack").focus({ preventScroll: true });
      if (event.button === 1 || (event.button === 0 && event.shiftKey)) this.drag(event, over);
    }, true);
    this.touch(over);
  }

  /** Moves the view with the mouse, instead of choosing a part of it. */
  drag(event, over) {
    event.preventDefault();
    event.stopImmediatePropagation();
    let before = event.clientX;
    const move = (next) => {
      this.view.pan((before - next.clientX) / over.clientWidth);
      before = next.clientX;
    };
    const up = () => {
      removeEventListener("mousemove", move);
      removeEventListener("mouseup", up);
    };
    addEventListener("mousemove", move);
    addEventListener("mouseup", up);
  }

  /** One finger moves, two zoom. */
  touch(over) {
    const fingers = new Map();
    const middle = () => [...fingers.values()].reduce((sum, x) => sum + x, 0) / fingers.size;
    const spread = () => Math.max(20, Math.abs([...fingers.values()].reduce((a, b) => a - b)));
    over.addEventListener("pointerdown", (event) => event.pointerType === "touch" && fingers.set(event.pointerId, event.clientX));
    over.addEventListener("pointermove", (event) => {
      if (!fingers.has(event.pointerId)) return;
      const [at, wide] = [middle(), fingers.size === 2 ? spread() : 0];
      fingers.set(event.pointerId, event.clientX);
      this.view.pan((at - middle()) / over.clientWidth);
      if (fingers.size === 2) {
        const left = over.getBoundingClientRect().left;
        this.view.zoom(wide / spread(), this.view.from + (this.view.to - this.view.from) * (middle() - left) / over.clientWidth);
      }
    });
    for (const end of ["pointerup", "pointercancel", "pointerleave"]) {
      over.addEventListener(end, (event) => fingers.delete(event.pointerId));
    }
  }
}
