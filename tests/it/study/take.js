// Takes part in a study of two conditions with a marked task each; what it returns is judged by study.rs.
const find = (query) => document.querySelector(query);
const until = async (holds, what) => {
  for (let n = 0; !holds(); n++) {
    if (n > 1500) throw new Error(`not after half a minute: ${what}: ${document.body.innerText.slice(0, 300)}`);
    await after(20);
  }
};
const seen = [];
find("#participant").value = "2";
find("#start").click();
for (let condition = 0; condition < 2; condition++) {
  await until(() => find("iframe")?.contentDocument?.querySelector("#begin"), "the instrument");
  const inside = find("iframe").contentDocument;
  await until(() => inside.querySelector("#status"), "its page");
  await after(300);
  inside.querySelector("#begin").click();
  await until(() => !find("#done").disabled, "the player");
  seen.push(find("h1").textContent);
  const pad = inside.querySelector("#pad");
  pad.setPointerCapture = () => {};
  const point = (kind, x, y) => {
    const box = pad.getBoundingClientRect();
    const View = find("iframe").contentWindow.PointerEvent;
    pad.dispatchEvent(new View(kind, { pointerId: 1, clientX: box.left + x * box.width, clientY: box.top + y * box.height, bubbles: true, buttons: 1 }));
  };
  point("pointerdown", 0.5, 0.05);
  for (let n = 0; n < 100 && find("#done") && !find("#done").disabled; n++) {
    point("pointermove", 0.5 + 0.1 * Math.sin(n / 3), 0.5 - 0.45 * Math.cos(n / 9));
    await after(15);
  }
  point("pointerup", 0.5, 0.5);
  if (find("#done") && !find("#done").disabled) find("#done").click();
  await until(() => find(".jspsych-survey-likert-opts"), "the questions");
  seen.push(document.querySelectorAll(".jspsych-survey-likert-statement").length);
  if (globalThis.axe && condition === 0) seen.push((await axe.run(document)).violations.map(({ id, nodes }) => `${id}: ${nodes[0].html}`));
  document.querySelectorAll(".jspsych-survey-likert-opts").forEach((row, n) => row.querySelectorAll("input")[condition + 2 * n].click());
  find("input[type=submit]").click();
}
await until(() => find(".jspsych-survey-multi-choice-option"), "the preference");
document.querySelectorAll(".jspsych-survey-multi-choice-option input")[1].click();
find("input[type=submit]").click();
await until(() => find("textarea:not(#table)"), "the comment");
find("textarea").value = 'it "rang", well';
find("input[type=submit]").click();
await until(() => find("#table"), "the end");
return { seen, table: find("#table").value };
