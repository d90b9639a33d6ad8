// Tables that sort by a click on a heading, show their minor rows when asked, and lead to an instant or a section.

function liveTable(table, go) {
  const body = table.querySelector("tbody");
  table.querySelectorAll("th").forEach((th, at) => {
    const button = el("button", { type: "button" }, th.textContent);
    th.replaceChildren(button);
    button.addEventListener("click", () => sortTable(table, body, th, at));
  });
  const all = table.closest(".table").querySelector(".all input");
  if (all) {
    const show = () => table.classList.toggle("few", !all.checked);
    all.addEventListener("change", show);
    show();
  }
  for (const row of body.rows) {
    if (!("t" in row.dataset || "section" in row.dataset)) continue;
    row.tabIndex = 0;
    row.setAttribute("role", "link");
    row.addEventListener("click", () => go(row));
    row.addEventListener("keydown", (event) => {
      if (event.key !== "Enter") return;
      event.preventDefault();
      go(row);
    });
  }
}

function sortTable(table, body, th, at) {
  const down = th.getAttribute("aria-sort") === "ascending";
  table.querySelectorAll("th").forEach((other) => other.removeAttribute("aria-sort"));
  th.setAttribute("aria-sort", down ? "descending" : "ascending");
  const key = (row) => {
    const cell = row.cells[at];
    return cell.dataset.n === undefined ? cell.textContent : Number(cell.dataset.n);
  };
  // Blank cells come last either way.
  const compare = (a, b) => {
    const [x, y] = [key(a), key(b)];
    if (x === "" || y === "") return (x === "") - (y === "");
    const order = typeof x === "number" && typeof y === "number" ? x - y : String(x).localeCompare(String(y));
    return down ? -order : order;
  };
  body.append(...[...body.rows].sort(compare));
}
