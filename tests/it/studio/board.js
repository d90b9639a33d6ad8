// In the studio, behind axe-core: the gesture is played on the emulated board, a tick is looked into, stepped through and left.
// (a body of an asynchronous function, with `after(ms)`; what it returns is judged by studio/board.rs)
const find = (query) => document.querySelector(query);
const text = (query) => find(query)?.textContent ?? "";
const until = async (what, holds) => {
  for (let n = 0; !holds(); n++) {
    if (n > 6000) throw new Error(`${what}: not after two minutes: "${text("#status")}", "${text("#board-said")}"`);
    await after(20);
  }
};
const upToDate = () => text("#status") === "Up to date.";
const choose = (query, value) => {
  find(query).value = value;
  find(query).dispatchEvent(new Event("change"));
};
/** What is shown of the instruction. */
const seen = () => ({ where: text("#board-where"), code: text("#board-listing .now"), line: text(".cm-board"), registers: text("#board-registers"), changed: document.querySelectorAll(".register.changed").length });
await until("the first", upToDate);
choose("#example", "hammond.whip");
await until("the organ", upToDate);
find("#board-keys").value = "3";
find("#board-seconds").value = "0.05";
const told = {};
find("#emulate").click();
told.isBusy = find("#emulate").disabled;
await until("a tick", () => !find("#board-result").hidden && !find("#emulate").disabled);
told.said = text("#board-said");
told.tick = Number(find("#board-tick").value);
told.lines = document.querySelectorAll("#board-ticks line").length;
told.first = seen();
for (let n = 0; n < 200 && !text(".cm-board").includes("force"); n++) find("#board-step").click();
told.later = seen();
find("#board-step").click();
told.next = seen();
find("#board-back").click();
told.back = seen();
find("#board-run").click();
told.runs = text("#board-run");
await until("it runs", () => seen().where !== told.back.where);
find("#board-run").click();
told.paused = text("#board-run");
const paused = seen();
await after(300);
told.stays = paused.where === seen().where;
find("#board-next").click();
await until("the next tick", () => find("#board-tick").value === String(told.tick + 1) && !find("#emulate").disabled);
told.nextTick = seen();
const box = find("#board-ticks").getBoundingClientRect();
find("#board-ticks").dispatchEvent(new MouseEvent("click", { clientX: box.left + 0.1 * box.width }));
await until("a tick of the picture", () => Number(find("#board-tick").value) < told.tick && !find("#emulate").disabled);
told.clicked = Number(find("#board-tick").value);
const { violations } = await axe.run("main", { iframes: false });
told.found = violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html).join(" ")}`);
told.wide = document.documentElement.scrollWidth <= innerWidth;
// What cannot be emulated is told; a change takes away what is of another program.
choose("#board", "pico2_knob");
await until("the other board", () => find("#board-result").hidden && upToDate());
find("#emulate").click();
await until("a refusal", () => find("#board-said").classList.contains("late"));
told.refused = text("#board-said");
choose("#board", "rp2350");
await until("the board again", upToDate);
told.cleared = text("#board-said") === "" && !find(".cm-board");
return told;
