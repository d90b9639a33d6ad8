// In the studio: a mistake is made, seen and mended; curves change; a key is pressed; firmware is taken home; a link is made.
// (a body of an asynchronous function, with `after(ms)`; what it returns is judged by studio.rs)
const find = (query) => document.querySelector(query);
const told = { waited: {} };
/** Waits until something holds, at most so long. */
const until = async (what, holds, seconds = 120) => {
  const from = performance.now();
  while (!holds()) {
    if (performance.now() - from > 1000 * seconds) throw new Error(`${what}: not after ${seconds} s; status "${find("#status").textContent}", problems "${find("#problems").textContent}", so far ${JSON.stringify(told)}`);
    await after(20);
  }
  told.waited[what] = Math.round(performance.now() - from);
};
// What is downloaded is kept.
const kept = new Map();
const make = URL.createObjectURL.bind(URL);
const blobs = new Map();
URL.createObjectURL = (blob) => {
  const url = make(blob);
  blobs.set(url, blob);
  return url;
};
HTMLAnchorElement.prototype.click = function () {
  kept.set(this.download, blobs.get(this.href));
};

// The first program plays before the compiler is there, and goes on when that has made the same page.
const player = find("#player");
await until("a player", () => player.contentDocument?.querySelector("#pad"));
player.contentWindow.isFirst = true;
const upToDate = () => find("#status").textContent === "Up to date.";
await until("up to date", upToDate);
told.isFirst = player.contentWindow.isFirst === true;
told.version = find("#version").textContent;
told.cores = document.querySelectorAll("#budget .fill").length;
told.fits = find("#budget").textContent;
told.cycles = document.querySelectorAll(".cycles").length;
told.coloured = new Set([...document.querySelectorAll(".cm-line span[class]")].map((span) => getComputedStyle(span).color)).size;

// A mistake: a keyword typed wrongly.
const editor = find(".cm-content");
const lines = () => [...document.querySelectorAll(".cm-line")];
const line = lines().find((one) => one.textContent.trim().startsWith("param "));
told.typedAt = line.textContent;
const select = (from, to) => {
  const walker = document.createTreeWalker(line, NodeFilter.SHOW_TEXT);
  let [at, start, end] = [0, null, null];
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    if (!start && from <= at + node.length) start = [node, from - at];
    if (!end && to <= at + node.length) end = [node, to - at];
    at += node.length;
  }
  getSelection().setBaseAndExtent(...start, ...end);
};
editor.focus();
const place = line.textContent.indexOf("param ");
select(place, place + 5);
await after(50);
document.execCommand("insertText", false, "parm");
await until("mistake seen", () => find("#problems .error"));
told.mistake = find("#problems .error").textContent;
told.underlined = document.querySelectorAll(".cm-lintRange-error").length;
told.disabled = find(".export").disabled;
find("#problems .error button:last-of-type").click();
await until("explained", () => find("#problems pre"));
told.explained = find("#problems pre").textContent;
const fix = find("#problems .fix");
told.fix = fix?.textContent;
fix?.click();
await until("mended", () => !find("#problems .error") && upToDate());

// The curves follow the program.
const before = find("#curves").src;
find("#example").value = "hammond.whip";
find("#example").dispatchEvent(new Event("change"));
await until("other curves", () => find("#curves").src !== before && upToDate());
told.alt = find("#curves").alt;

// A key is dragged in the page that plays.
const frame = find("#player");
await until("a page to play", () => frame.contentDocument?.querySelector("#pad") && frame.contentDocument.title === "hammond");
const inside = (query) => frame.contentDocument.querySelector(query);
const pad = inside("#pad");
const from = performance.now();
const { left, top, width, height } = pad.getBoundingClientRect();
const pointer = (type, part) => pad.dispatchEvent(new frame.contentWindow.PointerEvent(type, { pointerId: 1, bubbles: true, clientX: left + 0.4 * width, clientY: top + part * height }));
pad.setPointerCapture = () => {};
pointer("pointerdown", 0.1);
for (let part = 0.1; part < 0.95; part += 0.02) {
  pointer("pointermove", part);
  await after(15);
}
await until("heard", () => inside("#events").children.length > 0, 20);
pointer("pointerup", 0.95);
told.played = { events: inside("#events").textContent, status: inside("#status").textContent, ticks: inside("#ticks").textContent };

// Firmware, C and a link.
find("#keys").value = "8";
find('[data-kind="uf2"]').click();
await until("firmware", () => kept.has("hammond.uf2"));
const bytes = new Uint8Array(await kept.get("hammond.uf2").arrayBuffer());
told.uf2 = btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
find('[data-kind="c"]').click();
await until("C", () => kept.has("hammond.c") && kept.has("hammond.h") && kept.has("hammond.rs"));
told.c = await kept.get("hammond.c").text();
find("#link").click();
await until("a link", () => location.hash.length > 100);
told.hash = location.hash.length;
find("#example").value = "grand-piano.whip";
find("#example").dispatchEvent(new Event("change"));
await until("the first again", upToDate);
// A megabyte, and more than the compiler reads.
const view = CodeMirror.EditorView.findFromDOM(find(".cm-editor"));
view.dispatch({ changes: { from: view.state.doc.length, insert: "// quite long\n".repeat(75_000) } });
await until("a megabyte", upToDate);
told.megabyte = view.state.doc.length;
view.dispatch({ changes: { from: 0, to: view.state.doc.length, insert: "// much too long\n".repeat(280_000) } });
await until("too long", () => find("#problems .error"));
told.tooLong = find("#problems").textContent;
view.dispatch({ changes: { from: 0, to: view.state.doc.length, insert: "" } });
await until("empty", () => !find("#problems").textContent.includes("longer"));
told.empty = find("#problems").textContent + find("#status").textContent;
told.wide = document.documentElement.scrollWidth <= innerWidth;
return told;
