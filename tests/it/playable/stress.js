// What a page says of a flood of MIDI and of a page that was hidden; `mode` stands before this text.
const find = (query) => document.querySelector(query);
const text = (query) => find(query).textContent;
const until = async (holds) => { for (let n = 0; n < 400 && !holds(); n++) await after(25); };
if (mode === "silent") {
  // A device that never answers: the context never begins.
  AudioContext.prototype.resume = () => new Promise(() => {});
  find("#begin").click();
  await until(() => text("#status").startsWith("The player cannot"));
  return { status: text("#status"), again: !find("#begin").disabled };
}
let input = null;
navigator.requestMIDIAccess = async () => ({ inputs: new Map([["a", (input = { name: "flood" })]]) });
find("#midi").click();
await until(() => text("#ticks"));
// Ten thousand messages in a second: notes that begin and end, all over the keys.
const from = performance.now();
for (let n = 0; n < 10000; n++) {
  const note = 60 + (n % 25);
  input.onmidimessage({ data: n % 2 ? [0x80, note - 1, 0] : [0x90, note, 100] });
  if (n % 100 === 99) await after(Math.max(0, from + n / 10 - performance.now()));
}
const flood = text("#status");
// Nothing is held for ever: every key comes up.
for (let note = 0; note < 128; note++) input.onmidimessage({ data: [0x80, note, 0] });
await after(1500);
const played = Number(text("#ticks").match(/^[\d.]+/)[0]);
const later = Number(text("#strikes").match(/^\d+/)?.[0] ?? 0);
await after(1000);
const still = Number(text("#strikes").match(/^\d+/)?.[0] ?? 0);
// No frames for three seconds, as in a page that is hidden; then they come again.
const [frame, waiting] = [globalThis.requestAnimationFrame, []];
globalThis.requestAnimationFrame = (draw) => waiting.push(draw);
Object.defineProperty(document, "visibilityState", { value: "hidden", configurable: true });
document.dispatchEvent(new Event("visibilitychange"));
await after(3000);
const meanwhile = waiting.length;
globalThis.requestAnimationFrame = frame;
Object.defineProperty(document, "visibilityState", { value: "visible", configurable: true });
document.dispatchEvent(new Event("visibilitychange"));
waiting.forEach((draw) => frame(draw));
await after(1000);
return { flood, played, later, still, meanwhile, hidden: text("#status"), ticks: text("#ticks"), after: Number(text("#ticks").match(/^[\d.]+/)[0]) };
