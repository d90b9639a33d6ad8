// The studio: a text, and what the compiler makes of it. Every answer is the command's own, run in a worker (`wasi.js`).
//
//   text --150 ms--> check --right--> page (to play), run (curves), budget (cycles)
//
// Each of the three has a worker; a change stops what is not wanted any more.

const data = JSON.parse(find("#data").textContent);
/** How long nothing is typed before the compiler is asked (ms). */
const QUIET_MS = 150;
const state = { file: "program.whip", others: new Map(), generation: 0, timer: 0, instruments: [], isRight: false };
const encoder = new TextEncoder();
const lanes = {};

const status = (text) => (find("#status").textContent = text);

/** The files of the program: the text, and what stands beside it. */
function filesOf(text) {
  return new Map([...state.others, [state.file, encoder.encode(text)]]);
}

/** The words that name the program, and the instrument if there are several. */
function programWords() {
  const chosen = state.instruments.length > 1 ? [find("#instrument").value] : [];
  return [state.file, ...chosen];
}

/** Objects of a command that prints one a line. */
function objects(text) {
  return text.split("\n").filter((line) => line.startsWith("{")).map((line) => JSON.parse(line));
}

/** What a command that failed said, for a person. */
const said = (done) => (done.errors + done.output).trim() || `the command ended with ${done.code}`;

// From a change of the text to what is shown.

function changed() {
  if (!lanes.answers) return;
  clearTimeout(state.timer);
  state.generation += 1;
  status("Changed …");
  for (const name of ["pictures", "proofs"]) lanes[name]?.stop();
  forgetBoard();
  state.timer = setTimeout(update, QUIET_MS);
}

async function update() {
  const generation = state.generation;
  const text = textOf(editor);
  const isNow = () => generation === state.generation;
  lanes.answers.stop();
  const done = await lanes.answers.run(["check", state.file, "--json", "--numbers"], filesOf(text));
  if (!done || !isNow()) return;
  const told = objects(done.output);
  const diagnostics = told.filter(({ kind }) => kind === "diagnostic");
  showDiagnostics(editor, state.file, diagnostics);
  showProblems(diagnostics, done.code > 1 ? said(done) : "");
  state.isRight = done.code === 0;
  document.querySelectorAll(".result").forEach((result) => result.classList.toggle("stale", !state.isRight));
  document.querySelectorAll(".export").forEach((button) => (button.disabled = !state.isRight));
  enableBoard();
  if (!state.isRight) return status("The program is not right yet: what is shown is of the last one that was.");
  showInstruments(told.filter(({ kind }) => kind === "numbers").map(({ instrument }) => instrument));
  await Promise.all([showPage(text, isNow).then(() => showCurves(text, isNow)), showBudget(text, isNow)]);
  if (isNow()) status(["Up to date.", state.remark].filter(Boolean).join(" "));
}

/** The choice of an instrument, where there are several. */
function showInstruments(names) {
  const select = find("#instrument");
  const isSame = names.join() === state.instruments.join();
  state.instruments = names;
  find("#instrument-label").hidden = names.length < 2;
  if (!isSame) select.replaceChildren(...names.map((name) => el("option", { value: name }, name)));
}

function showProblems(diagnostics, failure) {
  const counted = ["error", "warning", "note"].map((severity) => [severity, diagnostics.filter((one) => one.severity === severity).length]);
  const words = counted.filter(([, count]) => count > 0).map(([severity, count]) => `${count} ${severity}${count > 1 ? "s" : ""}`);
  find("#count").textContent = failure ? "the command failed" : words.join(", ") || "nothing is wrong";
  const items = diagnostics.map((one) => {
    const { file, start } = one.place;
    const where = `${file === state.file ? "" : `${file}, `}line ${start.line}`;
    const explain = el("button", { type: "button", onclick: (event) => showExplained(one.code, event.target.closest("li")) }, "Explain");
    const go = el("button", { type: "button", onclick: () => goTo(one) }, where);
    const fixes = one.suggestions.filter((change) => change.file === state.file).map((change) =>
      el("button", { type: "button", class: "fix", onclick: () => mend(editor, state.file, change) }, `Write ${change.replacement.trim() || "nothing"}`));
    const notes = one.notes.map((note) => el("p", { class: "note" }, note));
    return el("li", { class: one.severity }, el("p", {}, `${one.code}: ${one.message}`), ...notes, el("div", { class: "row" }, go, ...fixes, explain));
  });
  find("#problems").replaceChildren(...items, ...(failure ? [el("li", { class: "error" }, el("pre", { tabindex: "0" }, failure))] : []));
}

function goTo({ place }) {
  if (place.file !== state.file) return;
  const at = placesOf(textOf(editor))(place.start.byte);
  editor.dispatch({ selection: { anchor: at }, scrollIntoView: true });
  editor.focus();
}

async function showExplained(code, item) {
  const there = item.querySelector("pre");
  if (there) return there.remove();
  const done = await lanes.answers.run(["explain", code], new Map());
  if (done) item.append(el("pre", { tabindex: "0" }, said(done)));
}

/** The page that plays, as `whippen page` makes it. */
async function showPage(text, isNow) {
  const done = await lanes.pictures.run(["page", ...programWords(), "-o", data.playable], filesOf(text));
  if (!done || !isNow()) return;
  const html = done.files.get(data.playable);
  find("#play-why").textContent = html ? "" : said(done);
  if (!html) return;
  playPage(html);
}

/** Puts a page that plays in its frame; one of the same bytes plays on. */
function playPage(bytes) {
  const page = new TextDecoder().decode(bytes);
  if (find("#player").srcdoc !== page) find("#player").srcdoc = page;
}

/** The curves of the bundled gesture, as `whippen run` draws them. */
async function showCurves(text, isNow) {
  const done = await lanes.pictures.run(["run", ...programWords(), "--plot", "curves.svg", "--json"], filesOf(text));
  if (!done || !isNow()) return;
  const picture = done.files.get("curves.svg");
  find("#curves-why").textContent = picture ? "" : said(done);
  if (!picture) return;
  const image = find("#curves");
  URL.revokeObjectURL(image.src);
  image.src = URL.createObjectURL(new Blob([picture], { type: "image/svg+xml" }));
  const [run] = objects(done.output);
  image.alt = `Forces, travel and states of ${run.instrument} over ${run.seconds.toFixed(1)} s: ${run.events} events, ${run.strikes ?? 0} strikes`;
  image.hidden = false;
}

/** What is proven of cycles: for as many keys as fit, or for the keyboard. */
async function showBudget(text, isNow) {
  const board = ["--board", find("#board").value];
  const hasKeyboard = /^\s*keyboard\b/m.test(text);
  const words = ["budget", state.file, "--json", ...(hasKeyboard ? [] : [...board, ...programWords().slice(1)])];
  let done = await lanes.proofs.run(hasKeyboard ? words : [...words, "--most-keys"], filesOf(text));
  // What is played once has no number of keys.
  const mostKeys = !hasKeyboard && done?.code !== 2;
  if (done && !mostKeys && !hasKeyboard) done = await lanes.proofs.run(words, filesOf(text));
  if (!done || !isNow()) return;
  const budgets = objects(done.output).filter(({ kind }) => kind === "budget");
  find("#budget").replaceChildren(...budgets.flatMap((budget) => budgetPicture(budget, mostKeys)), ...(budgets.length === 0 ? [el("pre", { tabindex: "0" }, said(done))] : []));
  showCycles(editor, cyclesOfLines(budgets, state.file));
}

// The editor's questions.

async function complete(context) {
  const word = context.matchBefore(/[A-Za-z_][A-Za-z0-9_]*/);
  if (!word && !context.explicit) return null;
  const text = context.state.doc.toString();
  const answer = await askServer(lanes.answers, filesOf(text), state.file, text, "textDocument/completion", { position: positionOf(context.state, context.pos) });
  const items = answer?.items ?? answer ?? [];
  const options = items.map(({ label, detail, documentation }) => ({ label, detail, info: documentation?.value ?? documentation }));
  return options.length > 0 ? { from: word?.from ?? context.pos, options, validFor: /^\w*$/ } : null;
}

async function hover(view, at) {
  const text = textOf(view);
  const answer = await askServer(lanes.answers, filesOf(text), state.file, text, "textDocument/hover", { position: positionOf(view.state, at) });
  const shown = answer?.contents?.value;
  return shown ? { pos: at, create: () => ({ dom: el("pre", {}, shown) }) } : null;
}

const grammar = JSON.parse(find("#grammar").textContent);
const editor = makeEditor(find("#editor"), { changed, complete, hover, grammar });

// What one takes home.

const stem = () => state.file.replace(/\.whip$/, "");

function download(name, bytes, type = "application/octet-stream") {
  const url = URL.createObjectURL(new Blob([bytes], { type }));
  el("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 1000);
}

/** The words of each export, and the endings of the files that it makes. */
function exportWords(kind) {
  const program = programWords();
  const keys = find("#keys").value === "" ? [] : ["--keys", find("#keys").value];
  const hasKeyboard = /^\s*keyboard\b/m.test(textOf(editor));
  const board = hasKeyboard ? [] : ["--board", find("#board").value];
  const file = `${stem()}.${kind}`;
  const build = (endings) => [["build", ...(kind === "uf2" || kind === "elf" ? [state.file, ...program.slice(1)] : program), ...board, ...keys, "-o", file], endings];
  return {
    uf2: () => build(["uf2"]),
    elf: () => build(["elf"]),
    c: () => build(["c", "h", "rs"]),
    wasm: () => build(["wasm"]),
    html: () => [["run", ...program, "--report", file], ["html"]],
    wav: () => [["run", ...program, "--out", file], ["wav"]],
  }[kind]();
}

async function exportFile(kind) {
  const [words, endings] = exportWords(kind);
  find("#export-said").textContent = `whippen ${words.join(" ")} …`;
  lanes.exports.stop();
  const done = await lanes.exports.run(words, filesOf(textOf(editor)));
  if (!done) return;
  const made = endings.map((ending) => `${stem()}.${ending}`).filter((name) => done.files.has(name));
  made.forEach((name) => download(name, done.files.get(name)));
  find("#export-said").textContent = `whippen ${words.join(" ")}\n${said(done)}`;
}

/** The program as a part of the page's address. */
async function link() {
  const text = JSON.stringify({ file: state.file, text: textOf(editor) });
  const packed = await through(encoder.encode(text), new CompressionStream("deflate-raw"));
  const letters = btoa(Array.from(packed, (byte) => String.fromCharCode(byte)).join("")).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
  location.hash = letters;
  try {
    await navigator.clipboard.writeText(location.href);
    status("The link is in the clipboard, and in the address.");
  } catch {
    status("The link is in the address.");
  }
}

/** The program of the page's address, or none. */
async function linked() {
  if (location.hash.length < 2) return null;
  try {
    const packed = unbase64(location.hash.slice(1).replaceAll("-", "+").replaceAll("_", "/"));
    const { file, text } = JSON.parse(new TextDecoder().decode(await through(packed, new DecompressionStream("deflate-raw"))));
    if (typeof text === "string" && /^[\w.-]+\.whip$/.test(file)) return { file, text };
  } catch {
    // Said below.
  }
  state.remark = "The address holds no program that can be read: this is the first of the bundled ones.";
  return null;
}

/** Begins with a program; what is bundled stands beside bundled keyboards. */
function open({ file, text }) {
  state.file = file;
  const isKeyboard = data.examples.some((example) => example.file === file && example.keyboard);
  state.others = new Map(isKeyboard ? data.examples.filter((example) => !example.keyboard).map((example) => [example.file, encoder.encode(example.text)]) : []);
  find("#example").value = data.examples.some((example) => example.file === file) ? file : "";
  setText(editor, text);
}

async function format() {
  const done = await lanes.answers?.run(["fmt", state.file], filesOf(textOf(editor)));
  const laidOut = done?.files.get(state.file);
  if (laidOut) setText(editor, new TextDecoder().decode(laidOut));
}

async function begin() {
  find("#example").append(...data.examples.map(({ file }) => el("option", { value: file }, file.replace(/\.whip$/, ""))));
  find("#board").append(...data.boards.map((name) => el("option", { value: name }, name)));
  find("#board").value = "rp2350";
  const choose = ({ target }) => {
    state.remark = "";
    open(data.examples.find(({ file }) => file === target.value) ?? data.examples[0]);
  };
  find("#example").addEventListener("change", choose);
  for (const id of ["#board", "#instrument"]) find(id).addEventListener("change", changed);
  find("#format").addEventListener("click", format);
  find("#link").addEventListener("click", link);
  beginBoard();
  document.querySelectorAll(".export").forEach((button) => button.addEventListener("click", () => exportFile(button.dataset.kind)));
  const program = await linked();
  open(program ?? data.examples.find(({ file }) => file === data.first));
  try {
    // The first program can be played before the compiler is there.
    if (!program) playPage(await unpacked("first"));
    const module = await loadCompiler();
    const source = find("#wasi").textContent + find("#worker").textContent;
    for (const name of ["answers", "pictures", "proofs", "exports", "board"]) lanes[name] = new Lane(module, source);
  } catch (error) {
    return status(`The compiler cannot begin: ${error.message}. The studio needs WebAssembly, workers and DecompressionStream.`);
  }
  changed();
  find("#version").textContent = said(await lanes.exports.run(["--version"], new Map()));
}

begin();
