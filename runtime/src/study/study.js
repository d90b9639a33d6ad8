// A study in a page: jsPsych orders the forms and keeps the answers; the instrument is a trial type of its own, in a frame.
// Nothing leaves the page but the table that one saves.

const data = JSON.parse(find("#data").textContent);
const { plan } = data;
const host = find("#study");
const session = { participant: 0, rows: [] };
const TITLES = ["participant", "order", "condition", "kind", "item", "answer", "time_s", "data"];

function keep({ place = "", condition = "", kind, item = "", answer = "", time = "", more = "" }) {
  session.rows.push([session.participant, place, condition, kind, item, answer, time, more]);
}

/** A table as RFC 4180 has it. */
function table() {
  const cell = (value) => (/[",\r\n]/.test(String(value)) ? `"${String(value).replaceAll('"', '""')}"` : String(value));
  return [TITLES, ...session.rows].map((row) => row.map(cell).join(",")).join("\r\n") + "\r\n";
}

async function through(bytes, stream) {
  const piped = new Blob([bytes]).stream().pipeThrough(stream);
  return new Uint8Array(await new Response(piped).arrayBuffer());
}

const base64 = (bytes) => {
  let text = "";
  for (let at = 0; at < bytes.length; at += 8192) text += String.fromCharCode(...bytes.subarray(at, at + 8192));
  return btoa(text);
};

/** The page of a condition. */
async function pageOf(condition) {
  const packed = Uint8Array.from(atob(find(`#condition${condition}`).textContent), (letter) => letter.charCodeAt(0));
  return new TextDecoder().decode(await through(packed, new DecompressionStream("gzip")));
}

/** A number from 0 on below another: the same for a participant, a task and a turn. */
function drawn(seed, below) {
  let x = Math.imul(seed + 1, 0x9e3779b1) >>> 0;
  for (let n = 0; n < 4; n++) {
    x ^= x << 13;
    x ^= x >>> 17;
    x ^= x << 5;
  }
  return (x >>> 0) % below;
}

/** Targets of a task, never the same twice in a row. */
function targetsOf({ of, repeats }, seed) {
  const all = [];
  for (let n = 0; n < repeats; n++) {
    let next = drawn(1000 * seed + n, of);
    if (of > 1 && next === all[n - 1]) next = (next + 1) % of;
    all.push(next);
  }
  return all;
}

/** The trial type: an instrument in a frame, played until it is done or time is over. */
class InstrumentTrial {
  static info = { name: "whippen-instrument", version: "1.0.0", parameters: { condition: { type: 2, default: 0 }, task: { type: 2, default: 0 }, place: { type: 2, default: 1 } }, data: { ticks: { type: 2 }, errors: { type: 2 } } };

  constructor(jsPsych) {
    this.jsPsych = jsPsych;
  }

  trial(display, trial) {
    // A promise would end the trial by being kept.
    this.play(display, trial);
  }

  async play(display, trial) {
    const [condition, task] = [plan.conditions[trial.condition], plan.tasks[trial.task]];
    const about = { place: trial.place, condition: condition.name, item: task.name };
    const said = el("output", { role: "status", id: "said" }, "Press Begin in the instrument, then play.");
    const done = el("button", { type: "button", id: "done", disabled: "" }, "Done");
    const frame = el("iframe", { title: `The instrument: ${condition.title}` });
    display.replaceChildren(el("h1", {}, condition.title), el("p", {}, task.text), el("div", { class: "bar" }, done, said), frame);
    frame.srcdoc = await pageOf(trial.condition);
    const ask = (message) => frame.contentWindow.postMessage({ ...message, of: "whippen study" }, "*");
    const targets = task.target ? targetsOf(task.target, session.participant * 64 + trial.condition * 8 + trial.task) : [];
    const state = { met: 0, errors: 0, from: 0, timer: 0 };
    const mark = () => {
      ask({ kind: "target", at: targets[state.met] });
      said.textContent = `Play number ${targets[state.met] + 1}: ${state.met} of ${targets.length} done.`;
    };
    const finish = () => {
      clearTimeout(state.timer);
      done.disabled = true;
      ask({ kind: "logged" });
    };
    const heard = (event) => {
      const values = Object.fromEntries(event.args);
      const played = Math.round(values[task.target.argument]);
      const time = (event.tick / condition.rate).toFixed(4);
      const wanted = targets[state.met];
      if (wanted === undefined) return;
      keep({ ...about, kind: played === wanted ? "hit" : "error", answer: played, time, more: wanted });
      played === wanted ? (state.met += 1) : (state.errors += 1);
      state.met < targets.length ? mark() : finish();
    };
    const logged = async ({ ticks = 0, gesture = new Uint8Array(0), digests = [] }) => {
      removeEventListener("message", listen);
      keep({ ...about, kind: "gesture", answer: ticks, more: base64(await through(gesture, new CompressionStream("deflate-raw"))) });
      keep({ ...about, kind: "words", more: digests.join(" ") });
      if (task.target) keep({ ...about, kind: "errors", answer: state.errors });
      this.jsPsych.finishTrial({ ticks, errors: state.errors });
    };
    const listen = ({ source, data: told }) => {
      if (source !== frame.contentWindow || told?.of !== "whippen") return;
      if (told.kind === "playing") {
        ask({ kind: "log" });
        done.disabled = false;
        state.timer = setTimeout(finish, 1000 * task.lasts);
        targets.length > 0 ? mark() : (said.textContent = `Play; at most ${task.lasts} s.`);
      } else if (told.kind === "events" && task.target) told.events.filter(({ name }) => name === task.target.event).forEach(heard);
      else if (told.kind === "logged") logged(told);
    };
    addEventListener("message", listen);
    frame.addEventListener("load", () => ask({ kind: "knobs", names: condition.knobs, values: {} }));
    done.addEventListener("click", finish);
  }
}

/** The forms and trials of a participant, in their order. */
function timeline(order) {
  const all = [];
  order.forEach((condition, at) => {
    const about = { place: at + 1, condition: plan.conditions[condition].name };
    plan.tasks.forEach((_, task) => all.push({ type: InstrumentTrial, condition, task, place: at + 1 }));
    if (plan.items.length === 0) return;
    const labels = Array.from({ length: plan.points }, (_, n) => (n === 0 ? `1: ${plan.ends[0]}` : n === plan.points - 1 ? `${n + 1}: ${plan.ends[1]}` : String(n + 1)));
    const questions = plan.items.map(({ name, text }) => ({ prompt: text, name, labels, required: true }));
    const on_finish = ({ response }) => plan.items.forEach(({ name }) => keep({ ...about, kind: "answer", item: name, answer: response[name] + 1 }));
    all.push({ type: jsPsychSurveyLikert, preamble: `<h1>${escaped(plan.conditions[condition].title)}</h1>`, questions, button_label: "Continue", on_finish });
  });
  if (plan.preferred) {
    const options = plan.conditions.map(({ title }) => escaped(title));
    all.push({ type: jsPsychSurveyMultiChoice, questions: [{ prompt: plan.preferred, name: "preferred", options, required: true }], button_label: "Continue",
      on_finish: ({ response }) => keep({ kind: "preferred", answer: plan.conditions[options.indexOf(response.preferred)]?.name ?? "" }) });
  }
  if (plan.comment) {
    all.push({ type: jsPsychSurveyText, questions: [{ prompt: plan.comment, name: "comment", rows: 5 }], button_label: "Finish",
      on_finish: ({ response }) => keep({ kind: "comment", answer: response.comment }) });
  }
  return all;
}

const escaped = (text) => text.replace(/[&<>"]/g, (letter) => `&#${letter.charCodeAt(0)};`);

/** The end: the table is saved, again if one likes. */
function finished() {
  const name = `session-${session.participant}.csv`;
  const save = () => {
    const url = URL.createObjectURL(new Blob([table()], { type: "text/csv" }));
    el("a", { href: url, download: name }).click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
  };
  host.replaceChildren(el("h1", {}, "Thank you"), el("p", {}, `Everything that was answered and played is in ${name}; nothing of it leaves this page otherwise.`),
    el("button", { type: "button", id: "save", onclick: save }, "Save the table"), el("textarea", { id: "table", readonly: "", rows: "8", "aria-label": "The table" }));
  find("#table").value = table();
  save();
}

async function run() {
  session.participant = Number(find("#participant").value);
  if (!Number.isInteger(session.participant) || session.participant < 1 || session.participant > 9999) return (find("#wrong").textContent = "A whole number from 1 to 9999, please.");
  const order = data.orders[(session.participant - 1) % data.orders.length];
  addEventListener("beforeunload", (event) => session.rows.length > 0 && !find("#table") && event.preventDefault());
  host.replaceChildren();
  await initJsPsych({ display_element: host, on_finish: finished }).run(timeline(order));
}

find("#start").addEventListener("click", run);
