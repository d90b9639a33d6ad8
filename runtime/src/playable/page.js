// The page around the player: what a hand does, what one sees.

const data = JSON.parse(document.getElementById("data").textContent);
const bytes = Uint8Array.from(atob(document.getElementById("module").textContent), (letter) => letter.charCodeAt(0));
const section = WebAssembly.Module.customSections(new WebAssembly.Module(bytes), "whippen")[0];
const map = JSON.parse(new TextDecoder().decode(section));
const { meaning } = map;
const { ports, firstNote, mark } = data;
const rate = map.rate_hz[0] / map.rate_hz[1];

const status = (text) => (find("#status").textContent = text);
const hand = Object.fromEntries(data.hand.map(([name, value]) => [name, value]));
const state = { node: null, key: Math.floor(map.keys / 2), port: 0, places: new Float64Array(map.keys * ports.length), trail: [], events: 0, strikes: 0 };
const queue = [];

/** Tells the player, now or when it begins. */
function tell(message) {
  if (state.node) state.node.port.postMessage(message);
  else queue.push(message);
}

// The player.

async function begin() {
  if (state.node) return;
  find("#begin").disabled = true;
  try {
    const context = new AudioContext({ sampleRate: rate, latencyHint: "interactive" });
    const source = btoa(document.getElementById("player").textContent + document.getElementById("worklet").textContent);
    await context.audioWorklet.addModule(`data:text/javascript;base64,${source}`);
    const processorOptions = { bytes, map, ports, hand, firstNote, mark };
    const node = new AudioWorkletNode(context, "player", { numberOfInputs: 0, outputChannelCount: [2], processorOptions });
    node.onprocessorerror = () => status("The player has stopped: the audio thread reports an error. Reload the page.");
    node.port.onmessage = ({ data: message }) => (message.kind === "shown" ? shown(message) : save(message));
    node.connect(context.destination);
    await context.resume();
    Object.assign(state, { node, context });
    queue.splice(0).forEach(tell);
    tell({ kind: "show", key: state.key });
    status(`${context.state}, ${context.sampleRate} Hz, about ${Math.round(1000 * (context.baseLatency + (context.outputLatency || 0)))} ms to the ear`);
    document.body.classList.add("playing");
  } catch (error) {
    find("#begin").disabled = false;
    status(`The player cannot begin: ${error.message}. It needs WebAssembly, an audio device and ${rate} samples a second.`);
  }
}

function shown({ ticks, places, path, events, dropped }) {
  Object.assign(state, { places, ticks });
  state.trail.push(...Array.from({ length: path.length / (2 * ports.length) }, (_, n) => path.subarray(2 * ports.length * n, 2 * ports.length * (n + 1))));
  state.trail.splice(0, Math.max(0, state.trail.length - 4000));
  for (const event of events) told(event);
  find("#ticks").textContent = `${(ticks / rate).toFixed(1)} s played, ${dropped} samples dropped`;
  requestAnimationFrame(draw);
}

/** A line for an event; only the last ones stay. */
function told({ tick, key, name, args }) {
  state.events += 1;
  if (name === mark) state.strikes += 1;
  const note = map.keys > 1 ? `${noteName(firstNote + key)} ` : "";
  const values = args.map(([title, value]) => `${title} ${value.toPrecision(3)}`).join(", ");
  const list = find("#events");
  list.prepend(el("li", {}, `${(tick / rate).toFixed(3)} s  ${note}${name}  ${values}`));
  while (list.children.length > 12) list.lastChild.remove();
  find("#strikes").textContent = `${state.strikes} ${mark || "events"}`;
}

const NAMES = ["C", "C#", "D", "D#", "E", "F", "F#", "G", "G#", "A", "A#", "B"];
const noteName = (note) => `${NAMES[note % 12]}${Math.floor(note / 12) - 1}`;

// What a hand does.

function lead(key, port, x) {
  const { low, high } = data.reach[port];
  tell({ kind: "lead", key, port, x: Math.min(high, Math.max(low, x)) });
}

function choose(key) {
  state.key = key;
  state.trail = [];
  tell({ kind: "show", key });
  find("#key").textContent = map.keys > 1 ? noteName(firstNote + key) : "";
}

/** A stroke of a key: down at a speed, held. */
function strike(key, velocity) {
  const { low, high } = data.reach[0];
  const seconds = (high - low) / (0.25 * 2 ** ((velocity - 64) / 30));
  const from = performance.now();
  choose(key);
  held.set(key, true);
  const step = () => {
    if (!held.get(key)) return;
    const part = Math.min(1, (performance.now() - from) / 1000 / seconds);
    lead(key, 0, low + part * (high - low));
    if (part < 1) setTimeout(step, 4);
  };
  step();
}

const held = new Map();

function release(key) {
  held.delete(key);
  lead(key, 0, data.reach[0].low);
}

const isBlack = (key) => NAMES[(firstNote + key) % 12].length > 1;

/** Where keys are in the picture: { key, left, width, top, height }, black ones last. */
function keyboard(width, height) {
  const whites = Array.from({ length: map.keys }, (_, key) => key).filter((key) => !isBlack(key));
  const wide = width / Math.max(1, whites.length);
  let place = 0;
  const all = Array.from({ length: map.keys }, (_, key) => {
    if (isBlack(key)) return { key, left: place * wide - 0.3 * wide, width: 0.6 * wide, top: 0, height: 0.6 * height };
    return { key, left: place++ * wide, width: wide, top: 0, height };
  });
  return all.sort((a, b) => isBlack(a.key) - isBlack(b.key));
}

const pad = find("#pad");
const pointers = new Map();

function at(event) {
  const box = pad.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top, box.width, box.height];
}

/** How deep a pointer holds a key: not at its upper edge, fully at its lower one. */
function press(key, rect, y) {
  const { low, high } = data.reach[0];
  const part = Math.min(1, Math.max(0, (y - rect.top - 0.1 * rect.height) / (0.8 * rect.height)));
  lead(key, 0, low + part * (high - low));
}

pad.addEventListener("pointerdown", (event) => {
  begin();
  pad.setPointerCapture(event.pointerId);
  const [x, y, width, height] = at(event);
  if (!data.ofKey) {
    pointers.set(event.pointerId, true);
    return follow(event);
  }
  const rect = keyboard(width, height).reverse().find((r) => x >= r.left && x < r.left + r.width && y < r.top + r.height);
  if (!rect) return;
  choose(rect.key);
  pointers.set(event.pointerId, rect);
  press(rect.key, rect, y);
});
pad.addEventListener("pointermove", (event) => {
  if (!pointers.has(event.pointerId)) return;
  const all = event.getCoalescedEvents?.() ?? [];
  for (const one of all.length > 0 ? all : [event]) follow(one);
});
for (const end of ["pointerup", "pointercancel"]) {
  pad.addEventListener(end, (event) => {
    const rect = pointers.get(event.pointerId);
    pointers.delete(event.pointerId);
    if (rect && data.ofKey) lead(rect.key, 0, data.reach[0].low);
  });
}

/** A pointer that is down moves its key, or the first two ports. */
function follow(event) {
  const [x, y, width, height] = at(event);
  const rect = pointers.get(event.pointerId);
  if (data.ofKey) return rect && press(rect.key, rect, y);
  const part = [x / width, 1 - y / height];
  ports.slice(0, 2).forEach((_, port) => {
    const { low, high } = data.reach[port];
    move(port, low + Math.min(1, Math.max(0, part[port])) * (high - low));
  });
}

/** Moves a port of what is played once, and its slider with it. */
function move(port, x) {
  lead(0, port, x);
  const slider = find(`#port${port}`);
  if (!slider) return;
  slider.value = x;
  slider.nextSibling.textContent = withUnit(meaning.senses[port].unit)(x);
}

if (!data.ofKey && ports.length > 2) {
  pad.addEventListener("wheel", (event) => {
    event.preventDefault();
    const { low, high } = data.reach[2];
    const slider = find("#port2");
    move(2, Math.min(high, Math.max(low, Number(slider.value) - (event.deltaY / 2000) * (high - low))));
  }, { passive: false });
}

const LETTERS = "awsedftgyhujkolp";

addEventListener("keydown", (event) => {
  if (event.repeat || event.ctrlKey || event.metaKey || event.altKey || event.target.matches("input, button, summary")) return;
  const letter = LETTERS.indexOf(event.key.toLowerCase());
  if (!data.ofKey || letter < 0) return;
  begin();
  const key = Math.min(map.keys - 1, letter + (map.keys > 24 ? 12 * Math.floor(map.keys / 24) : 0));
  strike(key, event.shiftKey ? 110 : 75);
});
addEventListener("keyup", (event) => {
  const letter = LETTERS.indexOf(event.key.toLowerCase());
  if (data.ofKey && letter >= 0) release(Math.min(map.keys - 1, letter + (map.keys > 24 ? 12 * Math.floor(map.keys / 24) : 0)));
});
// The picture by the keyboard alone: a key is chosen and pressed, a port moved.
pad.addEventListener("keydown", (event) => {
  const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
  if (!steps) return;
  event.preventDefault();
  begin();
  if (data.ofKey && steps[0] !== 0) return choose(Math.min(map.keys - 1, Math.max(0, state.key + steps[0])));
  const port = data.ofKey ? 0 : steps[0] !== 0 ? 0 : Math.min(1, ports.length - 1);
  const { low, high } = data.reach[port];
  const far = data.ofKey ? steps[1] : steps[0] - steps[1];
  const place = state.wanted?.[port] ?? ports[port].start;
  const next = Math.min(high, Math.max(low, place + (far * (high - low)) / 20));
  state.wanted = { ...state.wanted, [port]: next };
  data.ofKey ? lead(state.key, 0, next) : move(port, next);
});

find("#midi").addEventListener("click", async () => {
  try {
    const access = await navigator.requestMIDIAccess();
    const hear = ({ data: [kind, note, velocity] }) => {
      const key = note - firstNote;
      if (key < 0 || key >= map.keys) return;
      if (kind >> 4 === 9 && velocity > 0) strike(key, velocity);
      else if (kind >> 4 === 8 || kind >> 4 === 9) release(key);
    };
    const inputs = [...access.inputs.values()];
    inputs.forEach((input) => (input.onmidimessage = hear));
    status(inputs.length > 0 ? `MIDI from ${inputs.map((input) => input.name).join(", ")}` : "No MIDI input is connected.");
    begin();
  } catch (error) {
    status(`No MIDI: ${error.message}`);
  }
});
find("#midi").hidden = !data.ofKey || !navigator.requestMIDIAccess;
find("#begin").addEventListener("click", begin);

// Sliders.

/** A slider with its name and its value. */
function slider(id, name, [low, high, value], text, moved, step = "any") {
  const output = el("output", { for: id }, text(value));
  const oninput = ({ target }) => {
    output.textContent = text(Number(target.value));
    moved(Number(target.value));
  };
  const input = el("input", { id, type: "range", min: low, max: high, step, value, oninput });
  return el("label", { for: id }, el("span", {}, name), input, output);
}

const withUnit = (unit) => (value) => `${Number(value.toPrecision(4))} ${unit ?? ""}`;

meaning.lives.forEach((live, at) => {
  const moved = (value) => tell({ kind: "set", live: at, value });
  // A switch has no unit.
  const [text, step] = live.unit === null ? [(value) => (value ? "on" : "off"), 1] : [withUnit(live.unit), "any"];
  find("#lives").append(slider(`live${at}`, live.name, [live.low, live.high, live.value], text, moved, step));
});
if (!data.ofKey) {
  ports.forEach((port, at) => {
    const { low, high } = data.reach[at];
    find("#ports").append(slider(`port${at}`, meaning.senses[at].name, [low, high, port.start], withUnit(meaning.senses[at].unit), (x) => lead(0, at, x)));
  });
}
data.hand.forEach(([name, , most, unit]) => {
  const moved = (value) => {
    hand[name] = value;
    tell({ kind: "hand", hand: { ...hand } });
  };
  find("#hand").append(slider(`hand-${name}`, name, [most / 1000, most, hand[name]], withUnit(unit), moved));
});
find("#hand").closest("details").hidden = ports.every((port) => port.mechanics === null);

// Recording.

find("#record").addEventListener("click", ({ target }) => {
  const isOn = target.getAttribute("aria-pressed") === "true";
  target.setAttribute("aria-pressed", String(!isOn));
  target.textContent = isOn ? "Record" : "Stop and save";
  begin();
  tell(isOn ? { kind: "recorded" } : { kind: "record", key: state.key });
});

function save(message) {
  const url = URL.createObjectURL(new Blob([recordingTable(message.words, ports, data.titles, rate)], { type: "text/csv" }));
  el("a", { href: url, download: `${meaning.instrument}.csv` }).click();
  URL.revokeObjectURL(url);
}

// Pictures.

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name);

/** A canvas as large as it is shown, and its context. */
function surface(canvas) {
  const scale = devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== Math.round(width * scale)) canvas.width = Math.round(width * scale);
  if (canvas.height !== Math.round(height * scale)) canvas.height = Math.round(height * scale);
  const g = canvas.getContext("2d");
  g.setTransform(scale, 0, 0, scale, 0, 0);
  g.clearRect(0, 0, width, height);
  return [g, width, height];
}

function draw() {
  const [g, width, height] = surface(pad);
  data.ofKey ? drawKeys(g, width, height) : drawPorts(g, width, height);
  drawLoop();
}

function drawKeys(g, width, height) {
  const { low, high } = data.reach[0];
  for (const { key, left, width: wide, top, height: tall } of keyboard(width, height)) {
    const depth = (state.places[key * ports.length] - low) / (high - low);
    g.fillStyle = colour(isBlack(key) ? "--black" : "--white");
    g.fillRect(left + 0.5, top, wide - 1, tall);
    g.fillStyle = colour("--pressed");
    g.fillRect(left + 0.5, top, wide - 1, Math.max(0, Math.min(1, depth)) * tall);
    g.strokeStyle = colour(key === state.key ? "--accent" : "--rule");
    g.lineWidth = key === state.key ? 2 : 1;
    g.strokeRect(left + 0.5, top + 0.5, wide - 1, tall - 1);
  }
}

function drawPorts(g, width, height) {
  const place = (port) => (state.places[port] - data.reach[port].low) / (data.reach[port].high - data.reach[port].low);
  const [x, y] = [place(0) * width, (1 - (ports.length > 1 ? place(1) : 0.5)) * height];
  g.strokeStyle = colour("--rule");
  g.strokeRect(0.5, 0.5, width - 1, height - 1);
  g.fillStyle = colour("--accent");
  g.beginPath();
  g.arc(x, y, 8, 0, 2 * Math.PI);
  g.fill();
}

/** Force over position of the first driven port, the last second and a half. */
function drawLoop() {
  const port = Math.max(0, ports.findIndex(({ drive }) => drive !== null));
  const [g, width, height] = surface(find("#loop"));
  const points = state.trail.map((row) => [row[2 * port], row[2 * port + 1]]);
  if (points.length === 0) return;
  const { low, high } = data.reach[port];
  const most = Math.max(0.5, ...points.map(([, force]) => Math.abs(force)));
  const x = (value) => 40 + ((value - low) / (high - low)) * (width - 50);
  const y = (force) => height / 2 - (force / most) * (height / 2 - 12);
  g.strokeStyle = colour("--rule");
  g.beginPath();
  g.moveTo(40, y(0));
  g.lineTo(width - 10, y(0));
  g.stroke();
  g.fillStyle = colour("--soft");
  g.font = "11px system-ui, sans-serif";
  const unit = meaning.drives[ports[port].drive]?.unit ?? "";
  g.fillText(`${most.toFixed(1)} ${unit}`, 2, 12);
  g.fillText(`−${most.toFixed(1)}`, 2, height - 4);
  g.strokeStyle = colour("--accent");
  g.beginPath();
  points.forEach(([place, force], n) => (n === 0 ? g.moveTo(x(place), y(force)) : g.lineTo(x(place), y(force))));
  g.stroke();
  find("#force").textContent = `${points[points.length - 1][1].toFixed(2)} ${unit}`;
}

ports.forEach((port, at) => {
  for (let key = 0; key < map.keys; key++) state.places[key * ports.length + at] = port.start;
});
choose(state.key);
draw();
addEventListener("resize", draw);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
