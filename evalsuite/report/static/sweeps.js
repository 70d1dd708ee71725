// Scores over a swept parameter: a small drawing for each technique, scene and target; a press opens it with axes.
"use strict";

(() => {
  const host = document.getElementById("sweeps");
  if (!host) return;
  const dialog = document.getElementById("sweep");
  const [WIDTH, HEIGHT, EDGE] = [150, 34, 4];

  // Cells that differ in one numeric parameter alone, by its value.
  function sweeps(cells) {
    const found = new Map();
    for (const cell of cells) {
      for (const [name, value] of Object.entries(cell.parameters)) {
        if (typeof value !== "number") continue;
        const others = Object.entries(cell.parameters).filter(([other]) => other !== name);
        const key = JSON.stringify([cell.technique, cell.scene, cell.target, name, others]);
        const one = found.get(key) ?? { technique: cell.technique, scene: cell.scene, target: cell.target, over: name, at: others, points: [] };
        found.set(key, one);
        one.points.push({ x: value, cell });
      }
    }
    return [...found.values()].filter((one) => new Set(one.points.map((point) => point.x)).size > 1)
      .map((one) => ({ ...one, points: one.points.sort((a, b) => a.x - b.x) }));
  }

  const logarithmic = (values) => values.every((v) => v > 0) && Math.max(...values) / Math.min(...values) > 5;

  function axis(values, size, flip) {
    const log = logarithmic(values);
    const to = log ? Math.log : Number;
    const [low, high] = [Math.min(...values), Math.max(...values)].map(to);
    return (v) => {
      const t = high > low ? Math.min(1, Math.max(0, (to(v) - low) / (high - low))) : 0.5;
      return Number((EDGE + (size - 2 * EDGE) * (flip ? 1 - t : t)).toFixed(2));
    };
  }

  function spark(points, says) {
    const x = axis(points.map((p) => p.x), WIDTH, false);
    const ends = points.flatMap((p) => [p.low ?? p.value, p.high ?? p.value, p.value]);
    const y = axis(ends, HEIGHT, true);
    return element("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, width: WIDTH, height: HEIGHT, role: "img", "aria-label": says },
      element("polyline", { points: points.map((p) => `${x(p.x)},${y(p.value)}`).join(" ") }),
      ...points.map((p) => element("line", { x1: x(p.x), x2: x(p.x), y1: y(p.low ?? p.value), y2: y(p.high ?? p.value) })),
      ...points.map((p) => element("circle", { cx: x(p.x), cy: y(p.value), r: 2.2 })));
  }

  function draw() {
    const chosen = scores.chosen();
    const { metric } = chosen;
    const found = sweeps(scores.data.cells.filter((cell) => scores.shown.has(cell.slug))).map((one) => ({
      ...one, points: one.points.map((p) => ({ ...p, ...chosen.of(p.cell) })).filter((p) => p.value !== undefined),
    })).filter((one) => one.points.length > 1);
    host.hidden = !found.length;
    host.querySelector("#sweeps-metric").textContent = `${metric.name} over the ${chosen.region}`;
    host.querySelector("tbody").replaceChildren(...found.map((one) => {
      const [first, last] = [one.points[0], one.points[one.points.length - 1]];
      const figures = (p) => `${scores.number(p.value, metric.unit)} (${scores.interval(p, metric.unit)})`;
      const says = `${one.technique}, ${one.scene}, ${one.target}: ${metric.name} ${one.points.map((p) => `${figures(p)} at ${one.over} ${p.x}`).join("; ")}`;
      const button = element("button", { type: "button", "aria-haspopup": "dialog", title: "Show with axes" }, spark(one.points, says));
      button.addEventListener("click", () => open(one, chosen));
      const side = (p) => element("td", { class: "num" }, scores.number(p.value, metric.unit), element("small", {}, scores.interval(p, metric.unit)));
      return element("tr", {},
        element("th", { scope: "row" }, one.technique, element("small", {}, one.at.map(([name, value]) => `${name} ${value}`).join(", "))),
        element("td", {}, one.scene), element("td", {}, one.target),
        element("td", {}, one.over, element("small", {}, `${first.x} … ${last.x}`)), side(first), element("td", { class: "spark" }, button), side(last));
    }));
  }

  function open(one, chosen) {
    const { metric } = chosen;
    dialog.querySelector("h2").textContent = `${one.technique} over ${one.over}`;
    dialog.querySelector("p").textContent = [one.scene, one.target, ...one.at.map(([name, value]) => `${name} ${value}`), `over the ${chosen.region}`].join(", ");
    dialog.querySelector("tbody").replaceChildren(...one.points.map((p) => element("tr", {},
      element("th", { scope: "row" }, element("a", { href: `cells/${encodeURIComponent(p.cell.slug)}.html` }, `${one.over} ${p.x}`)),
      element("td", { class: "num" }, scores.number(p.value, metric.unit)), element("td", { class: "num ci" }, scores.interval(p, metric.unit)))));
    dialog.showModal();
    const ylog = metric.kind === "log" && one.points.some((p) => p.value > 0);
    plots.points(dialog.querySelector(".plot"), {
      points: one.points.map((p) => ({ x: p.x, x0: p.x, x1: p.x, ...plots.ends(p, metric, ylog), name: `${one.over} ${p.x}`, colour: plots.colour(0), filled: true, label: "", shift: 0,
        first: `${scores.number(p.value, metric.unit)} [${scores.interval(p, metric.unit)}]`, second: "" })),
      line: one.points.map((p) => [p.x, plots.ends(p, metric, ylog).y]),
      x: one.over, y: scores.title(metric),
      xlog: logarithmic(one.points.map((p) => p.x)), ylog,
      says: `${metric.name} over ${one.over}, with 95 % intervals; the table below has the numbers`,
    });
  }

  dialog.querySelector(".close").addEventListener("click", () => dialog.close());
  dialog.addEventListener("click", (event) => { if (event.target === dialog) dialog.close(); });
  view.on(["metric", "region", "filter", "status"], draw);
  draw();
})();
