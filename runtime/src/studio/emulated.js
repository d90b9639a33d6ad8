// The emulated board: what `whippen run --engine emulated --steps` tells, to be stepped through.
//
//   gesture --command--> cycles of every tick --the longest, or one that is chosen--> command --> its instructions, with registers
//
// The board is deterministic, so a tick is looked into by playing the gesture again up to it: what is stepped through is a record, and
// goes backwards as well.

/** Ticks whose instructions are asked for at once. */
const STEPS_TICKS = 4;
/** Rows of the listing around the instruction. */
const ROWS = 60;
/** Instructions a second while it runs. */
const PACE = 40;
/** The width of the picture of cycles, and its height. */
const PICTURE = [720, 150];

const hex = (number, digits = 8) => (number >>> 0).toString(16).padStart(digits, "0");

/** What was told, and where one stands in it. */
const board = { told: null, words: null, files: null, core: 0, tick: 0, path: [], at: 0, timer: 0, isBusy: false };

/** The instructions of a core in a tick, each with all registers behind it. */
function pathOf(told, tick, core) {
  let registers = {};
  return told.steps.filter((step) => step.tick === tick && step.core === core).map((step) => {
    registers = { ...registers, ...step.changes };
    return { ...step, registers };
  });
}

/** The tick that took a core most, of some. */
function longestTick(ticks, core, from = 0, to = ticks.length) {
  let longest = from;
  for (let tick = from; tick < to; tick++) if (ticks[tick][core] > ticks[longest][core]) longest = tick;
  return longest;
}

/** The core whose longest tick is the longest of all. */
function busiestCore({ ticks, keys }) {
  const most = keys.map((_, core) => ticks[longestTick(ticks, core)][core]);
  return most.indexOf(Math.max(...most));
}

const secondsOf = ({ rate_hz: [ticks, seconds] }, tick) => (tick * seconds) / ticks;

/** In a sentence: how long ticks were, beside what is proven. */
function boardWords(told) {
  const { keys, bound_cycles: bounds, period_cycles: period, ticks } = told;
  const cores = keys.map((count, core) => {
    const longest = longestTick(ticks, core);
    const proven = bounds ? `of at most ${bounds[core]} that are proven` : "of which nothing is proven";
    return `core ${core} (${count} ${count === 1 ? "key" : "keys"}) took ${ticks[longest][core]} cycles in its longest tick, ${longest}, ${proven}`;
  });
  return `${told.instrument} on ${told.board}, ${ticks.length} ticks: ${cores.join("; ")}; a tick has ${period}.`;
}

// The picture: cycles of every tick, the bound, and what a tick has.

const SVG = "http://www.w3.org/2000/svg";

function drawn(tag, attributes, text = "") {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.textContent = text;
  return element;
}

function boardPicture(told, core, tick) {
  const [width, height] = PICTURE;
  const { ticks, bound_cycles: bounds, period_cycles: period } = told;
  const y = (count) => height - (count / period) * (height - 14);
  const columns = Math.min(width, ticks.length);
  const first = (column) => Math.floor((column * ticks.length) / columns);
  const x = (column) => ((column + 0.5) * width) / columns;
  const points = Array.from({ length: columns }, (_, column) => {
    const longest = longestTick(ticks, core, first(column), Math.max(first(column) + 1, first(column + 1)));
    return `${x(column).toFixed(1)},${y(ticks[longest][core]).toFixed(1)}`;
  });
  const line = (count, kind, words) => [
    drawn("line", { x1: 0, x2: width, y1: y(count), y2: y(count), class: kind }),
    drawn("text", { x: 4, y: y(count) - 3 }, `${count} ${words}`),
  ];
  const at = ((tick + 0.5) * width) / ticks.length;
  return [
    ...line(period, "period", "cycles a tick"),
    ...(bounds ? line(bounds[core], "bound", "proven") : []),
    drawn("polyline", { points: points.join(" "), class: "took" }),
    drawn("line", { x1: at, x2: at, y1: 0, y2: height, class: "at" }),
  ];
}

/** The tick of a place in the picture: of those that share it the longest. */
function tickAt(part) {
  const { ticks } = board.told;
  const column = Math.min(PICTURE[0] - 1, Math.max(0, Math.floor(part * PICTURE[0])));
  const from = Math.min(ticks.length - 1, Math.floor((column * ticks.length) / PICTURE[0]));
  return longestTick(ticks, board.core, from, Math.max(from + 1, Math.floor(((column + 1) * ticks.length) / PICTURE[0])));
}

// From the page's program to what is shown.

/** Asks for the cycles of ticks, and for the instructions of some. */
async function askBoard(words, files, from, count) {
  const steps = ["--steps", "steps.json", "--steps-from", String(from), "--steps-ticks", String(count)];
  const done = await lanes.board.run([...words, ...steps], files);
  if (!done) return null;
  const bytes = done.files.get("steps.json");
  if (!bytes) throw new Error(said(done));
  return JSON.parse(new TextDecoder().decode(bytes));
}

const boardSays = (text, isWrong = false) => {
  find("#board-said").textContent = text;
  find("#board-said").classList.toggle("late", isWrong);
};

/** Does something that asks the board, one at a time; what goes wrong is told. */
async function onBoard(what, act) {
  if (board.isBusy) return;
  pauseBoard();
  board.isBusy = true;
  enableBoard();
  boardSays(what);
  try {
    await act();
  } catch (error) {
    boardSays(error.message, true);
  }
  board.isBusy = false;
  enableBoard();
}

/** Plays the gesture on the board, and looks into its longest tick. */
function emulate() {
  const keys = find("#board-keys").value === "" ? [] : ["--keys", find("#board-keys").value];
  const seconds = find("#board-seconds").value === "" ? [] : ["--seconds", find("#board-seconds").value];
  const words = ["run", ...programWords(), "--engine", "emulated", "--board", find("#board").value, ...keys];
  const files = filesOf(textOf(editor));
  forgetBoard();
  return onBoard("The board plays the gesture …", async () => {
    const told = await askBoard([...words, ...seconds], files, 0, 0);
    if (!told) return boardSays("The program has changed: the board was stopped.");
    const core = busiestCore(told);
    Object.assign(board, { told, words, files, core });
    find("#board-core").replaceChildren(...told.keys.map((_, number) => el("option", { value: number }, String(number))));
    find("#board-core").value = core;
    find("#board-tick").max = told.ticks.length - 1;
    await lookInto(longestTick(told.ticks, core));
  });
}

/** Stands before the first instruction of a tick; asks for it where it is not there. */
async function lookInto(tick) {
  const { words, files } = board;
  const isThere = () => board.told.steps.some((step) => step.tick === tick);
  if (!isThere()) {
    const seconds = secondsOf(board.told, tick + STEPS_TICKS);
    const told = await askBoard([...words, "--seconds", String(seconds)], files, tick, STEPS_TICKS);
    if (!told || !board.told) return boardSays("The program has changed: the board was stopped.");
    board.told = { ...board.told, steps: told.steps, listing: told.listing };
    if (!isThere()) throw new Error(`There are no instructions of tick ${tick}.`);
  }
  Object.assign(board, { tick, at: 0, path: pathOf(board.told, tick, board.core) });
  find("#board-result").hidden = false;
  find("#board-tick").value = tick;
  find("#board-ticks").replaceChildren(...boardPicture(board.told, board.core, tick));
  boardSays(boardWords(board.told));
  showStep();
}

/** Another tick, if there is one. */
function goToTick(tick) {
  const last = board.told.ticks.length - 1;
  return onBoard(`The board plays up to tick ${tick} …`, () => lookInto(Math.min(last, Math.max(0, tick))));
}

/** The instruction where one stands: in the listing, in the program, in registers. */
function showStep() {
  const { told, path, at } = board;
  const step = path[at];
  if (!step) return boardSays(`Core ${board.core} does nothing in tick ${board.tick}.`, true);
  const index = told.listing.findIndex(({ address }) => address === step.address);
  const rows = told.listing.slice(Math.max(0, index - ROWS / 2), index + ROWS / 2);
  let [last, place] = [null, null];
  const shown = rows.flatMap((row) => {
    const heads = [];
    if (row.function !== last) heads.push(el("div", { class: "function" }, `${row.function ?? "?"}:`));
    last = row.function;
    const here = row.line ? `${row.file}:${row.line}` : "";
    const source = here !== place ? here : "";
    place = here;
    const isAt = row.address === step.address;
    const line = el("div", { class: isAt ? "code now" : "code", ...(isAt ? { "aria-current": "step" } : {}) });
    line.append(el("span", { class: "source" }, source), el("span", {}, `${hex(row.address)}  ${row.text}`));
    return [...heads, line];
  });
  const list = find("#board-listing");
  list.replaceChildren(...shown);
  const now = list.querySelector(".now");
  if (now) list.scrollTop = now.offsetTop - list.clientHeight / 2;
  const row = told.listing[index];
  const isHere = row?.file === state.file;
  showBoardLine(editor, isHere ? row.line : null);
  const took = told.ticks[board.tick][board.core];
  const item = row?.item ? ` of ${row.item}` : "";
  find("#board-where").textContent =
    `Tick ${board.tick} (${secondsOf(told, board.tick).toFixed(4)} s), instruction ${at + 1} of ${path.length}${item}: ` +
    `from cycle ${step.cycle} on, ${step.cycles} ${step.cycles === 1 ? "cycle" : "cycles"}${step.why ? ` (${step.why})` : ""}; the tick took ${took}.`;
  const registers = told.registers.map((name) => {
    const isNew = at > 0 && name in step.changes;
    return el("div", { class: isNew ? "register changed" : "register" }, el("span", {}, name), el("span", {}, hex(step.registers[name] ?? 0)));
  });
  find("#board-registers").replaceChildren(...registers);
  enableBoard();
}

/** Goes some instructions on or back; from a tick's end into the next. */
async function stepBoard(by) {
  const to = board.at + by;
  if (to >= 0 && to < board.path.length) {
    board.at = to;
    return showStep();
  }
  const tick = board.tick + Math.sign(by);
  if (tick < 0 || tick >= board.told.ticks.length) return pauseBoard();
  const isRunning = board.timer !== 0;
  await goToTick(tick);
  if (board.tick !== tick) return;
  if (by < 0) {
    board.at = Math.max(0, board.path.length - 1);
    showStep();
  }
  if (isRunning) runBoard();
}

function runBoard() {
  board.timer = setInterval(() => stepBoard(1), 1000 / PACE);
  enableBoard();
}

function pauseBoard() {
  clearInterval(board.timer);
  board.timer = 0;
  enableBoard();
}

/** What can be pressed. */
function enableBoard() {
  const canStep = board.told !== null && !board.isBusy;
  find("#emulate").disabled = !state.isRight || board.isBusy;
  document.querySelectorAll(".on-board").forEach((one) => (one.disabled = !canStep));
  find("#board-back").disabled = !canStep || (board.tick === 0 && board.at === 0);
  find("#board-run").textContent = board.timer ? "Pause" : "Run";
}

/** What was told is of another program. */
function forgetBoard() {
  pauseBoard();
  lanes.board?.stop();
  Object.assign(board, { told: null, path: [] });
  find("#board-result").hidden = true;
  boardSays("");
  showBoardLine(editor, null);
  enableBoard();
}

function beginBoard() {
  const on = (id, act) => find(id).addEventListener("click", act);
  on("#emulate", emulate);
  on("#board-back", () => stepBoard(-1));
  on("#board-step", () => stepBoard(1));
  on("#board-run", () => (board.timer ? pauseBoard() : runBoard()));
  on("#board-next", () => goToTick(board.tick + 1));
  on("#board-longest", () => goToTick(longestTick(board.told.ticks, board.core)));
  on("#board-ticks", (event) => {
    const { left, width } = event.currentTarget.getBoundingClientRect();
    if (board.told) goToTick(tickAt((event.clientX - left) / width));
  });
  find("#board-tick").addEventListener("change", ({ target }) => goToTick(Math.trunc(Number(target.value)) || 0));
  find("#board-core").addEventListener("change", ({ target }) => {
    board.core = Number(target.value);
    goToTick(board.tick);
  });
}
