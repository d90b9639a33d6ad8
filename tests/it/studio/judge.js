// In the studio: axe-core, which stands before this text, judges the page with a right program and with a wrong one.
// (a body of an asynchronous function, with `after(ms)`; what it returns is judged by studio.rs)
const find = (query) => document.querySelector(query);
const until = async (holds) => {
  for (let n = 0; !holds(); n++) {
    if (n > 6000) throw new Error(`not after two minutes: "${find("#status").textContent}"`);
    await after(20);
  }
};
const found = async () => {
  const { violations } = await axe.run(document, { iframes: false });
  return violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html).join(" ")}`);
};
await until(() => find("#status").textContent === "Up to date.");
const right = await found();
const view = CodeMirror.EditorView.findFromDOM(find(".cm-editor"));
view.dispatch({ changes: { from: 0, to: view.state.doc.length, insert: "instrument a {\n    sense x: length in 0 mm .. 10 mm\n    force f = weigth\n}\n" } });
await until(() => find("#problems .error"));
find("#problems .error button:last-of-type").click();
await until(() => find("#problems pre"));
const wrong = await found();
// What axe-core must find, where it looks at all.
find("#count").after(Object.assign(document.createElement("img"), { src: "data:," }));
return { right, wrong, planted: await found() };
