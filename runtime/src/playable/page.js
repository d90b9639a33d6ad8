// The page around the player: what a hand does, what one sees. `window.js` stands before it.

const bytes = Uint8Array.from(atob(document.getElementById("module").textContent), (letter) => letter.charCodeAt(0));
const section = WebAssembly.Module.customSections(new WebAssembly.Module(bytes), "whippen")[0];
const map = JSON.parse(new TextDecoder().decode(section));
const { meaning } = map;
const { ports, firstNote, mark } = data;
const rate = map.rate_hz[0] / map.rate_hz[1];

const status = (text) => (find("#status").textContent = text);
const hand = Object.fromEntries(data.hand.map(([name, value]) => [name, value]));
const state = { node: null, key: Math.floor(map.keys / 2), port: 0, places: new Float64Array(map.keys * ports.length), trail: [], latest: null, drawn: [], moving: null };
const queue = [];
/** Lines of the list of events. */
const LINES = 12;
/** The most notes of MIDI that begin in a second: all keys of a piano five times. */
const NOTES_MAX = 440;
/** How long a sound device may take to answer (ms). */
const SILENT_MS = 3000;

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
    const processorOptions = { bytes, map, ports, hand, firstNote, mark, window: data.window };
    const node = new AudioWorkletNode(context, "player", { numberOfInputs: 0, outputChannelCount: [2], processorOptions });
    node.onprocessorerror = () => status("The player has stopped: the audio thread reports an error. Reload the page.");
    node.port.onmessage = ({ data: message }) => ({ shown, recorded: save, logged: tellFrame })[message.kind](message);
    const analyser = new AnalyserNode(context, { fftSize: 8192, smoothingTimeConstant: 0.6 });
    node.connect(analyser).connect(context.destination);
    await starts(context);
    Object.assign(state, { node, context, analyser });
    // The change to `running` may be told before or after the clock has moved.
    const sounds = () =>
      status(`${context.state}, ${context.sampleRate} Hz, about ${Math.round(1000 * (context.baseLatency + (context.outputLatency || 0)))} ms to the ear`);
    context.onstatechange = sounds;
    queue.splice(0).forEach(tell);
    tell({ kind: "show", key: state.key });
    sounds();
    document.body.classList.add("playing");
    tellFrame({ kind: "playing" });
  } catch (error) {
    find("#begin").disabled = false;
    status(`The player cannot begin: ${error.message}. It needs WebAssembly, an audio device and ${rate} samples a second.`);
  }
}

/** Waits until the audio clock moves. */
async function starts(context) {
  const wait = new Promise((_, give) => setTimeout(() => give(new Error("the audio clock stands still, so no audio device answers")), SILENT_MS));
  await Promise.race([context.resume(), wait]);
  for (const from = performance.now(); context.currentTime === 0; await new Promise((go) => setTimeout(go, 20))) {
    if (performance.now() - from > SILENT_MS) await wait;
  }
}

function shown(message) {
  const first = state.latest === null;
  state.latest = message;
  state.trail.push(...rowsOf(message.path));
  state.trail.splice(0, Math.max(0, state.trail.length - 4000));
  if (first) requestAnimationFrame(picture);
}

/** Places and forces, a row for each time. */
function rowsOf(path) {
  const wide = 2 * ports.length;
  return Array.from({ length: path.length / wide }, (_, n) => path.subarray(wide * n, wide * (n + 1)));
}

/** One picture of what was told last. The player hears of it, and sends the next: in a hidden page nothing is drawn or sent. */
function picture(now) {
  const { ticks, places, events, counts, moving, dropped } = state.latest;
  Object.assign(state, { places, ticks, moving, latest: null });
  events.slice(-LINES).forEach(told);
  if (events.length > 0) tellFrame({ kind: "events", events });
  if (events.length > 0) find("#strikes").textContent = mark ? `${counts.strikes} ${mark}` : `${counts.events} events`;
  state.drawn.push(now);
  while (state.drawn[0] < now - 1000) state.drawn.shift();
  find("#ticks").textContent = `${(ticks / rate).toFixed(1)} s played, ${dropped} samples dropped, ${state.drawn.length} pictures a second`;
  draw();
  tell({ kind: "seen" });
}

/** A line for an event; only the last ones stay. */
function told({ tick, key, name, args }) {
  const note = map.keys > 1 ? `${noteName(firstNote + key)} ` : "";
  const values = args.map(([title, value]) => `${title} ${value.toPrecision(3)}`).join(", ");
  const list = find("#events");
  list.prepend(el("li", {}, `${(tick / rate).toFixed(3)} s  ${note}${name}  ${values}`));
  while (list.children.length > LINES) list.lastChild.remove();
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
  const stroke = {};
  held.set(key, stroke);
  const step = () => {
    // Another stroke of the key has begun, or it was let go.
    if (held.get(key) !== stroke) return;
    const part = Math.min(1, (performance.now() - from) / 1000 / seconds);
    lead(key, 0, low + part * (high - low));
    if (part < 1) setTimeout(step, 4);
  };
  step();
}

const held = new Map();

function release(key) {
  if (!held.delete(key)) return;
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
/** The ports that the pad moves, to the right and upwards. */
const padPorts = data.window?.pad ?? ports.slice(0, 2).map((_, port) => port);
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
    follow(event);
    return putDown(true);
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
    else if (rect && pointers.size === 0) putDown(false);
  });
}

/** A pointer that is down moves its key, or the first two ports. */
function follow(event) {
  const [x, y, width, height] = at(event);
  const rect = pointers.get(event.pointerId);
  if (data.ofKey) return rect && press(rect.key, rect, y);
  followIn(padPorts, [x / width, 1 - y / height]);
}

/** Moves two ports to a place of a view on them. */
function followIn(both, parts) {
  both.forEach((port, at) => {
    const { low, high } = data.reach[port];
    move(port, low + Math.min(1, Math.max(0, parts[at])) * (high - low));
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

if (!data.ofKey && (touch || ports.length > 2)) {
  pad.addEventListener("wheel", (event) => {
    event.preventDefault();
    if (touch) return pressHarder(event.deltaY / 2000);
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
  if (touch && [" ", "PageUp", "PageDown"].includes(event.key)) {
    event.preventDefault();
    begin();
    return event.key === " " ? putDown(!touching.isDown) : pressHarder(event.key === "PageDown" ? 0.05 : -0.05);
  }
  if (!steps) return;
  event.preventDefault();
  begin();
  if (data.ofKey && steps[0] !== 0) return choose(Math.min(map.keys - 1, Math.max(0, state.key + steps[0])));
  const port = data.ofKey ? 0 : padPorts[steps[0] !== 0 ? 0 : padPorts.length - 1];
  const { low, high } = data.reach[port];
  const far = data.ofKey ? steps[1] : steps[0] - steps[1];
  const place = state.wanted?.[port] ?? ports[port].start;
  const next = Math.min(high, Math.max(low, place + (far * (high - low)) / 20));
  state.wanted = { ...state.wanted, [port]: next };
  data.ofKey ? lead(state.key, 0, next) : move(port, next);
});

/** Messages of MIDI: of notes that begin no more than a second can carry; what is beyond is left out, counted and said. */
const flow = { from: 0, begun: 0, left: 0 };

function heard([kind, note, velocity]) {
  const key = note - firstNote;
  if (key < 0 || key >= map.keys) return;
  const begins = kind >> 4 === 9 && velocity > 0;
  if (!begins) return kind >> 4 === 8 || kind >> 4 === 9 ? release(key) : undefined;
  const now = performance.now();
  if (now - flow.from > 1000) Object.assign(flow, { from: now, begun: 0 });
  flow.begun += 1;
  if (flow.begun <= NOTES_MAX) return strike(key, velocity);
  flow.left += 1;
  status(`Too much MIDI: more than ${NOTES_MAX} notes in a second; ${flow.left} have been left out.`);
}

find("#midi").addEventListener("click", async () => {
  try {
    const access = await navigator.requestMIDIAccess();
    const hear = ({ data: message }) => heard(message);
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

/** A value in words. */
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
  if (!isOn) putDown(touching.isDown);
});

function save(message) {
  const url = URL.createObjectURL(new Blob([recordingTable(message.words, ports, data.titles, rate)], { type: "text/csv" }));
  el("a", { href: url, download: `${meaning.instrument}.csv` }).click();
  URL.revokeObjectURL(url);
}

// A study, where one frames this page: it asks for a log and names what is to be played.

const isFramed = parent !== window;

function tellFrame(message) {
  if (isFramed) parent.postMessage({ ...message, of: "whippen" }, "*");
}

addEventListener("message", ({ source, data: asked }) => {
  if (!isFramed || source !== parent || asked?.of !== "whippen study") return;
  if (asked.kind === "log" || asked.kind === "logged") tell({ kind: asked.kind });
  if (asked.kind === "log") putDown(touching.isDown);
  if (asked.kind === "target") state.target = asked.at;
  if (asked.kind === "knobs") {
    document.body.classList.add("studied");
    meaning.lives.forEach(({ name }, at) => (find(`#live${at}`).closest("label").hidden = !asked.names.includes(name)));
    for (const [name, value] of Object.entries(asked.values)) tell({ kind: "set", live: meaning.lives.findIndex((live) => live.name === name), value });
  }
  draw();
});

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
  if (data.ofKey) drawKeys(g, width, height);
  else if (shownWindow) drawWindow(g, width, height);
  else drawPorts(g, width, height);
  drawFront();
  drawSpectrum();
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
  find("#force").textContent = `${meaning.senses[port].name}: ${points[points.length - 1][1].toFixed(2)} ${unit}`;
}

ports.forEach((port, at) => {
  for (let key = 0; key < map.keys; key++) state.places[key * ports.length + at] = port.start;
});
choose(state.key);
putDown(false);
document.addEventListener("visibilitychange", () => {
  if (!state.node) return;
  if (document.visibilityState === "hidden") return (state.hiddenAt = performance.now());
  requestAnimationFrame(() => {
    const seconds = Math.round((performance.now() - state.hiddenAt) / 1000);
    status(`The page was hidden for ${seconds} s: the sound went on, pictures of that time are left out, and of its events the last are listed.`);
  });
});
if (shownWindow?.front) {
  const front = find("#front");
  const follows = (event) => {
    const box = front.getBoundingClientRect();
    followIn(shownWindow.front, [(event.clientX - box.left) / box.width, 1 - (event.clientY - box.top) / box.height]);
  };
  front.addEventListener("pointerdown", (event) => {
    begin();
    front.setPointerCapture(event.pointerId);
    follows(event);
  });
  front.addEventListener("pointermove", (event) => event.buttons > 0 && follows(event));
}
find("#sound").addEventListener("toggle", draw);
draw();
addEventListener("resize", draw);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
