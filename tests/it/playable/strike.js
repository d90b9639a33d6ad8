// Presses the middle of the picture, as a mouse does, until a note has sounded: a slow press has none.
const text = (query) => document.querySelector(query).textContent;
document.querySelector("#begin").click();
const pad = document.querySelector("#pad");
const box = pad.getBoundingClientRect();
pad.setPointerCapture = () => {};
const point = (kind, part) => pad.dispatchEvent(new PointerEvent(kind, {
  pointerId: 1, clientX: box.left + 0.5 * box.width, clientY: box.top + part * box.height, bubbles: true }));
for (let n = 0; n < 200 && !text("#ticks"); n++) await after(100);
for (let n = 0; n < 20 && !text("#events").includes("note"); n++) {
  point("pointerdown", 0.1);
  for (let part = 0.1; part < 0.95; part += 0.1) { point("pointermove", part); await after(5); }
  await after(400);
  point("pointerup", 0.95);
  await after(400);
}
const slider = document.querySelector("#lives input");
slider.value = slider.max;
slider.dispatchEvent(new Event("input"));
return { status: text("#status"), ticks: text("#ticks"), events: text("#events"), slider: text("#lives output"),
         wide: document.documentElement.scrollWidth <= innerWidth };
