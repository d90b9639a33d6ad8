// Strings in slow motion: their shapes in short windows of the run, with what rubs them. The other side is strings.rs.

const DOES = ["is free", "sticks", "slips"];
const SPEEDS = [[1 / 20, "1/20"], [1 / 100, "1/100"], [1 / 400, "1/400"], [1 / 2000, "1/2000"]];

/** 16-bit numbers, lowest byte first. */
function words(text) {
  const bytes = bytesOf(text);
  const view = new DataView(bytes.buffer);
  return Int16Array.from({ length: bytes.length / 2 }, (_, i) => view.getInt16(2 * i, true));
}

/** A window of a string: displacements as parts of the greatest, from -1 to 1. */
function shapesOf(window, string) {
  const u = words(window.u);
  const [states, places] = [bytesOf(window.s), bytesOf(window.p)];
  const shapes = Array.from({ length: u.length / string.places }, (_, i) =>
    Float32Array.from(u.subarray(i * string.places, (i + 1) * string.places), (word) => word / 32767));
  return { first: window.first, shapes, states, places };
}

/** The picture of a string at an instant. */
function drawString(canvas, string, window, at) {
  const [wide, high] = [canvas.clientWidth, canvas.clientHeight];
  const scale = devicePixelRatio || 1;
  canvas.width = Math.max(1, Math.round(wide * scale));
  canvas.height = Math.max(1, Math.round(high * scale));
  const ctx = canvas.getContext("2d");
  ctx.scale(scale, scale);
  const [left, right, middle] = [16, wide - 16, high / 2];
  const x = (place) => left + place * (right - left);
  const y = (u) => middle - u * (middle - 14);
  const line = (shape) => {
    ctx.beginPath();
    shape.forEach((u, i) => ctx.lineTo(x(i / (shape.length - 1)), y(u)));
    ctx.stroke();
  };
  ctx.lineJoin = "round";
  ctx.strokeStyle = ink("grid");
  ctx.lineWidth = 1;
  line([0, 0]);
  // Where it is at other instants of the window.
  ctx.strokeStyle = ink("faint");
  ctx.globalAlpha = 0.35;
  window.shapes.forEach(line);
  ctx.globalAlpha = 1;
  const shape = window.shapes[at];
  const state = window.states[at];
  if (state < 3) {
    const place = window.places[at] / 255;
    const near = place * (shape.length - 1);
    const before = Math.min(Math.floor(near), shape.length - 2);
    const u = shape[before] + (shape[before + 1] - shape[before]) * (near - before);
    ctx.fillStyle = ctx.strokeStyle = ink(["faint", "text", "up"][state]);
    ctx.lineWidth = state === 0 ? 1 : 3;
    ctx.beginPath();
    ctx.moveTo(x(place), 4);
    ctx.lineTo(x(place), high - 4);
    ctx.globalAlpha = 0.45;
    ctx.stroke();
    ctx.globalAlpha = 1;
    ctx.beginPath();
    ctx.arc(x(place), y(u), state === 0 ? 3 : 6, 0, 2 * Math.PI);
    ctx.fill();
  }
  ctx.strokeStyle = ctx.fillStyle = ink("accent");
  ctx.lineWidth = 2;
  line(shape);
  for (const end of [0, 1]) {
    ctx.beginPath();
    ctx.arc(x(end), y(0), 4, 0, 2 * Math.PI);
    ctx.fill();
  }
}

/** All strings of a run, with what plays them. */
function stringsOf(host, id) {
  const packed = dataOf("strings", id);
  const strings = packed.strings.map((string) => ({ ...string, windows: string.windows.map((w) => shapesOf(w, string)) }));
  const count = Math.max(...strings.map((string) => string.windows.length));
  const most = (window) => Math.max(...window.shapes.map((shape) => Math.max(...shape.map(Math.abs))));
  // It begins where the string that moves most does so.
  const loudest = strings.reduce((a, b) => (b.most > a.most ? b : a)).windows.map(most);
  const now = { window: loudest.indexOf(Math.max(...loudest)), ticks: 0, playing: false, last: null };
  const windowOf = (string) => string.windows[Math.min(now.window, string.windows.length - 1)];
  const lasts = () => Math.max(...strings.map((string) => windowOf(string).shapes.length * string.every));
  const panels = strings.map((string) => {
    const canvas = el("canvas", { class: "string", role: "img", "aria-label": `${string.name} in slow motion` });
    const does = el("output");
    const ends = string.along.map((m) => proper((m * 1e3).toPrecision(4).replace(/\.?0+$/, "")));
    const title = `${string.name}: ${ends[0]} to ${ends[1]} mm; up to ${(string.most * 1e3).toPrecision(2)} mm`;
    host.append(el("div", { class: "vibration" }, el("h4", {}, title, does), canvas));
    return { string, canvas, does };
  });
  const at = el("output", { class: "at" });
  const draw = () => {
    const first = windowOf(strings[0]).first;
    at.textContent = `${(packed.start + (first + now.ticks) / packed.rate_hz).toFixed(5)} s`;
    slider.value = now.window;
    for (const { string, canvas, does } of panels) {
      const window = windowOf(string);
      const shape = Math.floor(now.ticks / string.every) % window.shapes.length;
      drawString(canvas, string, window, shape);
      const state = window.states[shape];
      does.textContent = state < 3 ? `${string.friction} ${DOES[state]}` : "";
    }
  };
  const go = (window) => {
    now.window = (window + count) % count;
    now.ticks = 0;
    draw();
  };
  const frame = (ms) => {
    if (!now.playing) return;
    // A page that was out of sight goes on where it was.
    const passed = now.last === null ? 0 : Math.min(ms - now.last, 100);
    now.last = ms;
    now.ticks += passed / 1e3 * packed.rate_hz * SPEEDS[speed.value][0];
    if (now.ticks < lasts()) draw();
    else go(now.window + (repeat.checked ? 0 : 1));
    requestAnimationFrame(frame);
  };
  const play = el("button", { type: "button", title: "play or pause", onclick: () => {
    now.playing = !now.playing;
    now.last = null;
    play.textContent = now.playing ? "pause" : "play";
    if (now.playing) requestAnimationFrame(frame);
  } }, "play");
  const speed = el("select", { "aria-label": "speed" }, ...SPEEDS.map(([, name], i) => el("option", { value: i, selected: i === 2 }, `${name} of real time`)));
  const repeat = el("input", { type: "checkbox" });
  const slider = el("input", { type: "range", min: 0, max: count - 1, step: 1, "aria-label": "part of the run", oninput: () => go(Number(slider.value)) });
  const step = el("button", { type: "button", title: "the next shape", onclick: () => {
    now.ticks = (now.ticks + strings[0].every) % lasts();
    draw();
  } }, "step");
  host.prepend(el("h3", {}, "Strings in slow motion"), el("div", { class: "player" }, play, step, speed, el("label", {}, repeat, " repeat"), slider, at));
  new ResizeObserver(draw).observe(host);
  draw();
  return { theme: draw };
}
