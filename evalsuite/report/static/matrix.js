// The matrix technique × scene, coloured by the chosen metric.
"use strict";

(() => {
  const table = document.getElementById("matrix");
  const { data } = scores;
  const words = { failed: "failed", skipped: "skipped", uncertified: "not certified", scored: "no value" };

  const opened = () => new Set(view.get("open").split(",").filter(Boolean));

  // What is in focus is made anew with the table: where to find it then.
  function held() {
    const now = document.activeElement;
    if (!table.contains(now) || now === table) return () => null;
    const [key, technique] = [now.closest("th[data-key]")?.dataset.key, now.classList.contains("fold") && now.closest("tr").dataset.technique];
    if (key) return () => [...table.querySelectorAll("th[data-key]")].find((one) => one.dataset.key === key)?.querySelector("button");
    if (technique) return () => [...table.querySelectorAll("tr.lead")].find((one) => one.dataset.technique === technique)?.querySelector(".fold");
    return () => [...table.querySelectorAll("td a")].find((one) => one.getAttribute("href") === now.getAttribute("href"));
  }

  function draw() {
    const again = held();
    const chosen = scores.chosen();
    const { metric } = chosen;
    const all = data.cells.filter((cell) => cell.target === chosen.target);
    const cells = all.filter((cell) => scores.shown.has(cell.slug));
    const scale = scores.scale(metric, all.map(chosen.of).filter(Boolean).map((score) => score.value));
    const columns = [...new Set(cells.map((cell) => cell.scene))];
    const rows = sorted(groups(cells, chosen), chosen);
    const open = opened();
    table.replaceChildren(
      element("caption", { class: "hidden" }, `${metric.name} over the ${chosen.region} against ${chosen.target}, by technique and scene. Heads sort; an entry opens its cell.`),
      element("thead", {}, element("tr", {}, head("", "Technique"), ...columns.map((scene) => head(scene, scene)))),
      element("tbody", {}, ...rows.flatMap((group) => {
        const wide = group.rows.length > 1 && (open.has("all") || open.has(group.name));
        return [
          row(group, group.cells, columns, chosen, scale, { lead: true, wide }),
          ...(wide ? group.rows.map((one) => row(group, one.cells, columns, chosen, scale, { words: one.name })) : []),
        ];
      })),
    );
    again()?.focus({ preventScroll: true });
    legend(chosen, scale);
    document.getElementById("nothing").hidden = cells.length > 0;
    document.getElementById("expand").setAttribute("aria-pressed", String(open.has("all")));
  }

  function groups(cells) {
    const found = new Map();
    for (const cell of cells) {
      const group = found.get(cell.technique) ?? { name: cell.technique, cells: [], rows: new Map() };
      found.set(cell.technique, group);
      group.cells.push(cell);
      const name = scores.parameters(cell);
      const one = group.rows.get(name) ?? { name, cells: [] };
      group.rows.set(name, one);
      one.cells.push(cell);
    }
    return [...found.values()].map((group) => ({ ...group, rows: [...group.rows.values()] }));
  }

  // ---- order ----
  const order = () => ({ by: view.get("by"), down: view.get("down") === "1" });

  function sorted(found, chosen) {
    const { by, down } = order();
    if (!view.get("by") && !down) return found; // the report's own order
    const sign = down ? -1 : 1;
    const key = (cells) => {
      const worst = worstOf(cells.filter((cell) => cell.scene === by), chosen);
      return worst ? scores.badness(chosen.metric, chosen.of(worst).value) : null;
    };
    const compare = by === "name"
      ? (a, b) => sign * a.name.localeCompare(b.name, undefined, { numeric: true })
      : (a, b) => { const [x, y] = [key(a.cells), key(b.cells)]; return x === null || y === null ? (x === null) - (y === null) : sign * (x - y); };
    return found.map((group) => ({ ...group, rows: [...group.rows].sort(compare) })).sort(compare);
  }

  function head(key, label) {
    const { by, down } = order();
    const own = key || "name";
    const [scene, environment] = label.split(", ");
    const button = element("button", { type: "button" }, scene, environment ? element("small", {}, environment) : null);
    button.addEventListener("click", () => view.set({ by: own, down: by === own && !down ? "1" : "" }));
    return element("th", { scope: "col", "aria-sort": by === own ? (down ? "descending" : "ascending") : "none", "data-key": own }, button);
  }

  // ---- rows ----
  function row(group, cells, columns, chosen, scale, { lead = false, wide = false, words: own = "" }) {
    const many = group.rows.length > 1;
    let name = own || "as it is";
    if (lead && many) {
      name = element("button", { type: "button", class: "fold", "aria-expanded": String(wide) }, group.name, element("small", {}, `${group.rows.length} settings`));
      name.addEventListener("click", () => fold(group.name, wide));
    } else if (lead) {
      name = element("span", {}, group.name, group.rows[0].name ? element("small", {}, group.rows[0].name) : null);
    }
    return element("tr", { class: lead ? "lead" : "setting", "data-technique": group.name },
      element("th", { scope: "row" }, name),
      ...columns.map((scene) => entry(cells.filter((cell) => cell.scene === scene), chosen, scale, lead && many)));
  }

  function fold(technique, wide) {
    const open = opened();
    if (open.has("all")) { open.delete("all"); for (const cell of data.cells) open.add(cell.technique); }
    if (wide) open.delete(technique); else open.add(technique);
    view.set({ open: [...open].join(",") });
  }

  function worstOf(cells, chosen) {
    const scored = cells.filter((cell) => chosen.of(cell));
    const bad = (cell) => scores.badness(chosen.metric, chosen.of(cell).value);
    return scored.length ? scored.reduce((worst, cell) => (bad(cell) > bad(worst) ? cell : worst)) : null;
  }

  function entry(cells, chosen, scale, together) {
    if (!cells.length) return element("td", { class: "empty" });
    const cell = worstOf(cells, chosen) ?? cells[0];
    const score = chosen.of(cell);
    if (!score) return element("td", { class: "unscored" }, element("a", { href: `cells/${encodeURIComponent(cell.slug)}.html` }, words[cell.status] ?? cell.status));
    const { unit } = chosen.metric;
    const colour = scale.colour(score.value);
    const link = element("a", { href: `cells/${encodeURIComponent(cell.slug)}.html` },
      score.open ? element("abbr", { title: "inconclusive: noise could change the order of this cell and another of the same reference" }, "≈ ") : null,
      scores.number(score.value, unit), element("small", {}, scores.interval(score, unit)));
    const several = together && cells.length > 1;
    return element("td", { style: `background: ${scores.css(colour)}; color: ${scores.ink(colour)}`, "data-value": score.value },
      link, several ? element("span", { class: "of" }, `worst of ${cells.length}`) : null);
  }

  // ---- legend ----
  function legend(chosen, scale) {
    const { metric } = chosen;
    const host = document.getElementById("legend");
    const caption = `${metric.name}: ${metric.says}; ${scale.says}`;
    const stops = scale.stops.map((c, i) => `${scores.css(c)} ${(100 * i) / (scale.stops.length - 1)}%`).join(", ");
    const [first, last] = [scale.ticks[0], scale.ticks[scale.ticks.length - 1]];
    host.replaceChildren(
      element("div", { role: "img", "aria-label": `Colour scale from ${first[1]} to ${last[1]}. ${caption}` },
        element("div", { class: "bar", style: `background: linear-gradient(to right, ${stops})` }),
        element("div", { class: "ticks" }, ...scale.ticks.map(([at, label]) => element("span", { style: `left: ${(100 * at).toFixed(2)}%` }, label)))),
      element("p", {}, caption));
  }

  // Arrows go from entry to entry.
  table.addEventListener("keydown", (event) => {
    const step = { ArrowDown: [1, 0], ArrowUp: [-1, 0], ArrowRight: [0, 1], ArrowLeft: [0, -1] }[event.key];
    const from = event.target.closest("td, th");
    if (!step || !from) return;
    let [line, at] = [from.parentElement.rowIndex + step[0], from.cellIndex + step[1]];
    while (table.rows[line]?.cells[at]) {
      const next = table.rows[line].cells[at].querySelector("a, button");
      if (next) { next.focus(); event.preventDefault(); return; }
      line += step[0]; at += step[1];
    }
  });

  document.getElementById("expand").addEventListener("click", () => view.set({ open: opened().has("all") ? "" : "all" }));
  view.on(["metric", "region", "target", "by", "down", "open", "filter", "status"], draw);
  scores.dark.addEventListener("change", draw);
  draw();
})();
