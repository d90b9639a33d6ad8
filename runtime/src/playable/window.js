// The window: what moves and the tool that plays it, as in the windows of Onofrei, Fontana, Serafin 2023 (figures 7 and 10).
//
// Colours say what the paper's do: a bow or stick is grey above everything and orange where it touches, the denser the harder;
// masses are red, the lower the darker; the greatest displacement of a string is a red ellipse in the view from the front.

const data = JSON.parse(document.getElementById("data").textContent);
const shownWindow = data.window;
const tool = shownWindow?.tool ?? null;
const touch = shownWindow?.touch ?? null;
const touching = { isDown: false, level: touch?.down ?? 0 };
const ORANGE = "232, 135, 22";

/** Puts the tool down or takes it away. */
function putDown(isDown) {
  if (!touch) return;
  touching.isDown = isDown;
  const to = isDown ? touching.level : touch.up;
  if (touch.moves.port !== undefined) return move(touch.moves.port, to);
  const live = touch.moves.live;
  tell({ kind: "set", live, value: to });
  const slider = find(`#live${live}`);
  [slider.value, slider.nextSibling.textContent] = [to, withUnit(meaning.lives[live].unit)(to)];
}

/** Presses harder (or lighter) by a part of the whole. */
function pressHarder(part) {
  const [light, hard] = touch.levels;
  const place = Math.min(1, Math.max(0, (touching.level - light) / (hard - light) + part));
  touching.level = light + place * (hard - light);
  if (touching.isDown) putDown(true);
}

/** How hard the tool touches, 0 to 1, and in words. */
function pressed() {
  const { drive, port, live } = shownWindow.force;
  if (drive !== undefined) {
    const at = ports.findIndex((one) => one.drive === drive);
    const row = state.trail[state.trail.length - 1];
    const force = row ? Math.abs(row[2 * at + 1]) : 0;
    return [force / ports[at].fullScale, `${force.toFixed(2)} ${meaning.drives[drive].unit}`];
  }
  if (port !== undefined) {
    const { low, high } = data.reach[port];
    return [(state.places[port] - low) / (high - low), `${state.places[port].toFixed(2)} ${meaning.senses[port].unit}`];
  }
  const value = Number(find(`#live${live}`).value);
  return [value / meaning.lives[live].high, `${value.toFixed(1)} ${meaning.lives[live].unit}`];
}

const part = (port, x) => (x - data.reach[port].low) / (data.reach[port].high - data.reach[port].low);

/** A view on two ports: from SI to places on a canvas. */
function view([across, along], width, height) {
  const wide = data.reach[across].high - data.reach[across].low;
  return { x: (m) => part(across, m) * width, y: (m) => (1 - part(along, m)) * height, metre: width / wide };
}

/** How much displacements are enlarged, so that the greatest is a part of the picture that one sees. */
function enlarged(most, pixels, metre) {
  const steps = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000];
  const fits = steps.filter((step) => most * metre * step <= pixels);
  return fits[fits.length - 1] ?? 1;
}

function drawWindow(g, width, height) {
  const { strings, masses, plucked } = shownWindow;
  const pad = shownWindow.pad ?? [0, Math.min(1, ports.length - 1)];
  const at = view(pad, width, height);
  g.strokeStyle = colour("--rule");
  g.strokeRect(0.5, 0.5, width - 1, height - 1);
  if (strings.length > 0) drawStrings(g, at, width, height);
  if (masses.length > 0) drawMasses(g, at, width, height);
  if (plucked.length > 0) drawPlucked(g, at, width);
  if (state.target !== undefined) drawTarget(g, at, width);
  if (tool) drawTool(g, at, pad, width);
  else drawPorts(g, width, height);
}

function note(g, text, height) {
  g.fillStyle = colour("--soft");
  g.font = "11px system-ui, sans-serif";
  g.fillText(text, 6, height - 6);
}

function drawStrings(g, at, width, height) {
  const { strings, places, upright } = shownWindow;
  const moving = state.moving;
  const metre = places ? at.metre : 1000;
  const most = Math.max(1e-6, ...(moving ? moving.most : []));
  const times = enlarged(most, (0.35 * width) / Math.max(2, strings.length), metre);
  strings.forEach((string, n) => {
    const rest = places ? at.x(places[n][0]) : ((n + 0.5) * (upright ? width : height)) / strings.length;
    const shape = moving?.shapes[n] ?? [0, 0];
    g.strokeStyle = colour("--string");
    g.lineWidth = 3 - (2 * n) / strings.length;
    g.beginPath();
    shape.forEach((u, point) => {
      const along = point / (shape.length - 1);
      if (upright) g.lineTo(rest + u * metre * times, (1 - along) * (height - 8) + 4);
      else g.lineTo(along * (width - 8) + 4, rest + u * metre * times);
    });
    g.stroke();
  });
  note(g, `displacements × ${times}`, height);
}

function drawMasses(g, at, width, height) {
  const { masses, places } = shownWindow;
  const rest = (n) => (places ? [at.x(places[n][0]), at.y(places[n][1])] : [width / 2, height * (1 - (n + 0.5) / masses.length)]);
  const radius = Math.min(14, (0.42 * height) / masses.length);
  const metre = width / 0.16;
  const most = Math.max(1e-6, ...(state.moving?.masses ?? []).map(Math.abs));
  state.greatest = Math.max(most, 0.97 * (state.greatest ?? 0));
  const times = enlarged(state.greatest, 0.3 * width, metre);
  masses.forEach((_, n) => {
    const [x, y] = rest(n);
    const u = (state.moving?.masses[n] ?? 0) * metre * times;
    g.strokeStyle = colour("--rule");
    g.lineWidth = 1;
    g.beginPath();
    g.moveTo(x, y);
    g.lineTo(x + u, y);
    g.stroke();
    const bright = masses.length > 1 ? n / (masses.length - 1) : 0.5;
    g.fillStyle = `hsl(0, 75%, ${28 + 32 * bright}%)`;
    g.beginPath();
    g.arc(x + u, y, radius, 0, 2 * Math.PI);
    g.fill();
  });
  note(g, `displacements × ${times}`, height);
}

/** A plucked string: bent to the plectrum while it is held, else between its greatest displacements. */
function drawPlucked(g, at, width) {
  const { plucked, places } = shownWindow;
  const [x] = [at.x(state.places[0])];
  plucked.forEach((_, n) => {
    const y = at.y(places ? places[n][1] : 0);
    const bent = state.moving?.bent[n] ?? 0;
    const swing = Math.min(1, state.moving?.voices[n] ?? 0) * 14;
    g.strokeStyle = colour("--string");
    g.lineWidth = 3 - 0.35 * n;
    if (swing > 0.3) {
      g.fillStyle = colour("--swing");
      g.beginPath();
      g.moveTo(0, y);
      g.quadraticCurveTo(width / 2, y - 2 * swing, width, y);
      g.quadraticCurveTo(width / 2, y + 2 * swing, 0, y);
      g.fill();
    }
    g.beginPath();
    g.moveTo(0, y);
    if (bent !== 0) g.lineTo(x, at.y(state.places[1]));
    g.lineTo(width, y);
    g.stroke();
  });
}

/** A mark at what a study asks for. */
function drawTarget(g, at, width) {
  const place = shownWindow.places?.[state.target];
  if (!place) return;
  const isRow = !shownWindow.upright || shownWindow.masses.length > 0;
  const [x, y] = isRow ? [0.03 * width, at.y(place[1])] : [at.x(place[0]), 14];
  g.fillStyle = colour("--accent");
  g.beginPath();
  g.moveTo(x - 8, y - 8);
  g.lineTo(x + 8, isRow ? y : y - 8);
  g.lineTo(isRow ? x - 8 : x, y + 8);
  g.closePath();
  g.fill();
}

function drawTool(g, at, pad, width) {
  const [hard, words] = pressed();
  const isTouching = hard > 0.002 || (tool === "plectrum" && state.places[2] < 0);
  const [x, y] = [at.x(state.places[pad[0]]), at.y(state.places[pad[1]])];
  const opacity = 0.25 + 0.7 * Math.min(1, hard);
  g.fillStyle = isTouching ? `rgba(${ORANGE}, ${opacity})` : colour("--hovers");
  g.strokeStyle = colour("--soft");
  g.lineWidth = 1;
  g.beginPath();
  if (tool === "plectrum") {
    g.moveTo(x, y + 9);
    g.lineTo(x - 9, y - 12);
    g.lineTo(x + 9, y - 12);
    g.closePath();
  } else {
    const half = shownWindow.bow ? shownWindow.bow[1] * Math.cos(state.places[shownWindow.bow[0]]) * at.metre : 0.22 * width;
    g.rect(x - half, y - 7, 2 * half, 14);
  }
  g.fill();
  g.stroke();
  g.fillStyle = colour("--text");
  g.fillRect(x - 1, y - 1, 3, 3);
  find("#tool").textContent = `${tool} ${isTouching ? `touches, ${words}` : "hovers"}`;
}

/** The view from the front: where strings rest (cyan), how far they move (red), the bow as it leans. */
function drawFront() {
  if (!shownWindow?.front) return;
  const [g, width, height] = surface(find("#front"));
  const at = view(shownWindow.front, width, height);
  const most = Math.max(1e-6, ...(state.moving?.most ?? []));
  const times = enlarged(most, 0.06 * width, at.metre);
  shownWindow.places.forEach(([x, y], n) => {
    const swing = (state.moving?.most[n] ?? 0) * at.metre * times;
    g.fillStyle = "#c93636";
    g.beginPath();
    g.ellipse(at.x(x), at.y(y), 5 + swing, 6, 0, 0, 2 * Math.PI);
    g.fill();
    g.fillStyle = "#22a5b8";
    g.beginPath();
    g.arc(at.x(x), at.y(y), 5, 0, 2 * Math.PI);
    g.fill();
  });
  const [lean, half] = shownWindow.bow;
  const tilt = state.places[lean];
  const [x, y] = shownWindow.front.map((port) => state.places[port]);
  const [hard] = pressed();
  g.strokeStyle = hard > 0.002 ? `rgba(${ORANGE}, ${0.25 + 0.7 * Math.min(1, hard)})` : colour("--hovers");
  g.lineWidth = 6;
  g.beginPath();
  g.moveTo(at.x(x - half * Math.cos(tilt)), at.y(y - half * Math.sin(tilt)));
  g.lineTo(at.x(x + half * Math.cos(tilt)), at.y(y + half * Math.sin(tilt)));
  g.stroke();
  note(g, `greatest displacements × ${times}`, height);
}

// The spectrum of what is heard.

function drawSpectrum() {
  const { analyser, context } = state;
  if (!analyser || !find("#sound").open) return;
  const [g, width, height] = surface(find("#spectrum"));
  const levels = (state.levels ??= new Float32Array(analyser.frequencyBinCount));
  analyser.getFloatFrequencyData(levels);
  const [lowest, highest, floor] = [30, context.sampleRate / 2, -110];
  const x = (hz) => (Math.log(hz / lowest) / Math.log(highest / lowest)) * width;
  const y = (db) => (Math.min(0, db) / floor) * (height - 14);
  g.font = "11px system-ui, sans-serif";
  for (const hz of [50, 100, 200, 500, 1000, 2000, 5000, 10000]) {
    g.fillStyle = colour("--rule");
    g.fillRect(x(hz), 0, 1, height - 14);
    g.fillStyle = colour("--soft");
    g.fillText(hz < 1000 ? hz : `${hz / 1000}k`, x(hz) + 3, height - 3);
  }
  const step = context.sampleRate / analyser.fftSize;
  let best = 1;
  g.strokeStyle = colour("--accent");
  g.beginPath();
  for (let bin = Math.ceil(lowest / step); bin < levels.length; bin++) {
    if (levels[bin] > levels[best]) best = bin;
    g.lineTo(x(bin * step), y(Math.max(floor, levels[bin])));
  }
  g.stroke();
  find("#loudest").textContent = levels[best] > -90 ? `strongest at ${(best * step).toFixed(0)} Hz, ${levels[best].toFixed(0)} dB` : "silent";
}
