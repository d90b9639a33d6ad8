// Bows, rubs or plucks in the window for some seconds, by keyboard to begin with; axe-core, which may stand before this text, judges.
const find = (query) => document.querySelector(query);
const text = (query) => find(query).textContent;
find("#begin").click();
for (let n = 0; n < 200 && !text("#ticks"); n++) await after(100);
const pad = find("#pad");
pad.focus();
const press = async (key, times = 1) => {
  for (let n = 0; n < times; n++) {
    pad.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));
    await after(30);
  }
};
/** Waits until the window says what it is to say; five seconds at most, as a busy machine draws late. */
const says = async (what) => {
  for (let n = 0; n < 100 && !text("#tool").includes(what); n++) await after(50);
  return text("#tool");
};
const hovering = await says("hovers");
// By keyboard alone: down, harder, across.
await press(" ");
await press("PageDown", 2);
const touching = await says("touches");
await press("ArrowRight", 3);
await press(" ");
const lifted = await says("hovers");
// By pointer, three seconds.
const box = pad.getBoundingClientRect();
pad.setPointerCapture = () => {};
const point = (kind, x, y) => pad.dispatchEvent(new PointerEvent(kind, { pointerId: 1, clientX: box.left + x * box.width, clientY: box.top + y * box.height, bubbles: true, buttons: 1 }));
point("pointerdown", 0.5, 0.5);
const rates = [];
let tool = "", loudest = "";
const from = performance.now();
for (let now = from; now < from + 3500; now = performance.now()) {
  const way = (now - from) / 1000;
  point("pointermove", 0.5 + 0.3 * Math.sin(4 * way), 0.5 + 0.45 * Math.sin(1.3 * way));
  await after(8);
  if (now > from + 1200) rates.push(Number(text("#ticks").match(/, (\d+) pictures a second/)?.[1]));
  if (text("#tool").includes("touches")) tool = text("#tool");
  if (text("#loudest") && text("#loudest") !== "silent") loudest = text("#loudest");
}
if (!globalThis.keepDown) point("pointerup", 0.5, 0.5);
rates.sort((a, b) => a - b);
const found = globalThis.axe ? (await axe.run(document)).violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html).join(" ")}`) : null;
return { hovering, touching, lifted, tool, loudest, least: rates[0], usual: rates[Math.floor(rates.length / 2)], ticks: text("#ticks"), status: text("#status"), events: text("#events"), found,
         wide: document.documentElement.scrollWidth <= innerWidth };
