// What is proven of cycles, drawn: a bar a core, what takes the most, and how many keys fit.

/** A sentence about what fits. */
function fitsWords(budget, mostKeys) {
  const { board, keys, fits, period_cycles: period } = budget;
  const more = budget.cores.reduce((sum, { more_keys: count }) => sum + (count ?? 0), 0);
  const each = `a key takes at most ${budget.key.cycles_max} cycles and ${budget.key.contention_cycles_max} of waiting`;
  if (!fits) return `${board}: ${keys} keys do not fit; a tick has ${period} cycles, ${each}`;
  if (mostKeys) return `${board}: ${keys} keys fit; ${each}`;
  return `${board}: ${keys} ${keys === 1 ? "key fits" : "keys fit"}, and ${more} more; ${each}`;
}

/** A bar: how much of a whole. */
function bar(name, part, text) {
  const width = Math.min(100, 100 * part).toFixed(1);
  const fill = el("span", { class: part > 1 ? "fill late" : "fill" });
  fill.style.width = `${width}%`;
  return el("div", { class: "budget-row" }, el("span", { class: "budget-name" }, name), el("span", { class: "track" }, fill), el("span", { class: "budget-text" }, text));
}

/** The picture of one program's budget. */
function budgetPicture(budget, mostKeys) {
  const { cores, period_cycles: period, key } = budget;
  const rows = cores.map((core, at) => bar(`core ${at}`, core.utilization, `${core.cycles_max} of ${period} cycles, ${core.keys} ${core.keys === 1 ? "key" : "keys"}`));
  const items = Object.entries(key.by_item).sort(([, a], [, b]) => b - a).slice(0, 8);
  const most = Math.max(1, ...items.map(([, count]) => count));
  const parts = items.map(([name, count]) => bar(name, count / most, String(count)));
  return [
    el("p", { class: budget.fits ? "fits" : "late" }, `${budget.instrument}: ${fitsWords(budget, mostKeys)}.`),
    el("div", {}, ...rows),
    el("h3", {}, "Cycles of a key, on its longest path"),
    el("div", {}, ...parts),
  ];
}

/** Cycles by line of a file, over all programs the most. */
function cyclesOfLines(budgets, file) {
  const lines = new Map();
  for (const { key } of budgets) {
    const own = new Map();
    for (const { file: of, line, cycles: count } of key.worst_path) if (of === file) own.set(line, (own.get(line) ?? 0) + count);
    own.forEach((count, line) => lines.set(line, Math.max(count, lines.get(line) ?? 0)));
  }
  return lines;
}
