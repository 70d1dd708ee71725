// Interactive plots: Bokeh is loaded when the first comes into view. report/plots.py makes the figures; here they get their data
// and the page's colours.
"use strict";

const plots = (() => {
  // Of a cell's page: what goes into figures that all cells share. Else the figures themselves.
  const given = JSON.parse(document.getElementById("figures").textContent);
  const shared = typeof cellFigures === "undefined" ? null : cellFigures;
  // Okabe and Ito's colours but for black and yellow, which one of the two backgrounds swallows; and two of like lightness.
  const COLOURS = ["#3b8ed0", "#d9772b", "#2a9d74", "#c35fa0", "#b58b00", "#7a6fd0", "#c2504a", "#7f8c8d", "#4f9aa8", "#8a7a4f"];
  const drawn = new Map(); // host → draws its plot again
  const roots = new Map(); // host → Bokeh's views
  let library = null;

  function load() {
    library ??= new Promise((resolve, reject) => {
      const script = document.createElement("script");
      const path = "static/bokeh.min.js";
      const inline = document.querySelector(`script[data-file="../${path}"]`); // in a page of a single file
      if (inline) script.textContent = inline.textContent;
      else script.src = document.documentElement.dataset.root + path;
      script.onload = () => resolve(window.Bokeh);
      script.onerror = () => reject(new Error("static/bokeh.min.js could not be loaded"));
      document.head.append(script);
      if (inline) resolve(window.Bokeh); // it has run
    });
    return library;
  }

  // ---- dark and light ----
  // What a model of Bokeh's takes from the page's colours.
  function colours(model, tags) {
    const style = getComputedStyle(document.documentElement);
    const [paper, ink, soft, line] = ["paper", "ink", "soft", "line"].map((name) => style.getPropertyValue(`--es-${name}`).trim());
    if (model === "Figure") return { background_fill_color: paper, border_fill_color: paper, outline_line_color: line };
    if (/Axis$/.test(model)) return { axis_line_color: soft, major_tick_line_color: soft, minor_tick_line_color: null, major_label_text_color: soft, axis_label_text_color: ink };
    if (model === "Grid") return { grid_line_color: line };
    if (model === "Legend") return { background_fill_color: paper, border_line_color: null, label_text_color: ink };
    if (model === "Title") return { text_color: ink };
    if (tags?.includes("ink")) return model === "Text" ? { text_color: { type: "value", value: ink } } : { line_color: { type: "value", value: soft } };
    return {};
  }

  // Puts data, labels and colours into a figure of report/plots.py: name of a source or an axis → its columns, or its label; of
  // something else that has a name → its properties.
  function fill(node, given) {
    if (Array.isArray(node)) return node.map((one) => fill(one, given));
    if (!node || typeof node !== "object") return node;
    const made = Object.fromEntries(Object.entries(node).map(([key, value]) => [key, fill(value, given)]));
    if (node.type !== "object") return made;
    made.attributes = { ...made.attributes, ...colours(node.name, node.attributes?.tags) };
    const own = given[node.attributes?.name];
    if (typeof own === "string") made.attributes.axis_label = own;
    else if (own && node.name !== "ColumnDataSource") Object.assign(made.attributes, own);
    else if (own) made.attributes.data = { type: "map", entries: Object.entries(own) };
    return made;
  }

  // Draw a figure of report/plots.py in a host.
  async function embed(host, name, says, more = {}) {
    const own = shared && given[name];
    const figure = shared ? shared[own?.figure ?? name] : given[name];
    host.setAttribute("role", "group");
    host.setAttribute("aria-label", says);
    const again = () => embed(host, name, says, more);
    drawn.set(host, again);
    host.id ||= `plot-${drawn.size}`;
    try {
      const Bokeh = await load();
      if (drawn.get(host) !== again) return; // another came while the library loaded
      roots.get(host)?.clear();
      host.replaceChildren();
      const manager = await Bokeh.embed.embed_item({ ...fill(figure, { ...own?.given, ...more }), target_id: host.id }, host.id);
      if (drawn.get(host) === again) roots.set(host, manager);
      else manager.clear();
    } catch (error) {
      console.error(error);
      host.textContent = "The plot could not be drawn; the tables of this page have its numbers.";
    }
  }

  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { for (const again of drawn.values()) again(); });

  // Points with intervals and a line: points [{x, y, x0, x1, y0, y1, name, first, second, colour, filled, label}], line [[x, y]].
  async function points(host, { points: all, line, x, y, xlog, ylog, says }) {
    const table = (some) => Object.fromEntries(["x", "y", "x0", "x1", "y0", "y1", "name", "first", "second", "colour", "label", "aside", "shift", "align"].map((key) => [key, some.map((p) => p[key])]));
    const [first, last] = [Math.min(...all.map((p) => p.x)), Math.max(...all.map((p) => p.x))];
    for (const p of all) { // words of the right half stand on the left of their point
      const right = xlog ? p.x * p.x > first * last : 2 * p.x > first + last;
      Object.assign(p, { aside: right ? -7 : 7, align: right ? "right" : "left" });
    }
    await embed(host, `${xlog ? "log" : "linear"}-${ylog ? "log" : "linear"}`, says, {
      all: table(all), filled: table(all.filter((p) => p.filled)), hollow: table(all.filter((p) => !p.filled)),
      line: { x: line.map((p) => p[0]), y: line.map((p) => p[1]) }, "x-axis": x, "y-axis": y,
    });
  }

  const factor = (metric) => (metric.unit === "%" ? 100 : 1);
  // A score's value and interval in the plot's unit; an open end stays at the value. On a logarithmic axis what noise cannot tell
  // from 0 stands at a tenth of its interval's upper end, as in the envelopes.
  function ends(score, metric, log) {
    const least = log ? 0.1 * (score.high ?? 0) || 1e-9 : -Infinity;
    const [y, y0, y1] = [score.value, score.low ?? score.value, score.high ?? score.value].map((v) => factor(metric) * Math.max(v, least));
    return { y, y0, y1 };
  }

  // ---- accuracy against cost ----
  // On the front is what no other beats in one without losing in the other.
  function front(all) {
    const beats = (q, p) => q.bad <= p.bad && q.cost <= p.cost && (q.bad < p.bad || q.cost < p.cost);
    return all.filter((p) => !all.some((q) => beats(q, p)));
  }

  function pareto() {
    const host = document.getElementById("pareto-plot");
    const select = document.getElementById("truth");
    const chosen = scores.chosen();
    const { metric } = chosen;
    const truths = new Map();
    for (const cell of scores.data.cells) {
      if (cell.truth !== null && scores.shown.has(cell.slug) && cell.ms !== null && chosen.of(cell)) truths.set(cell.truth, [...(truths.get(cell.truth) ?? []), cell]);
    }
    const ordered = [...truths].filter(([, cells]) => cells.length > 1).sort((a, b) => b[1].length - a[1].length);
    document.getElementById("pareto").hidden = !ordered.length;
    if (!ordered.length) return;
    const names = scores.data.truths;
    const [truth, cells] = ordered.find(([one]) => names[one] === view.get("truth")) ?? ordered[0];
    select.replaceChildren(...ordered.map(([one, some]) => element("option", { value: names[one], selected: one === truth }, `${names[one]} (${some.length})`)));
    const techniques = [...new Set(cells.map((cell) => cell.technique))];
    const colour = (cell) => COLOURS[techniques.indexOf(cell.technique) % COLOURS.length];
    const all = cells.map((cell) => ({ cell, cost: cell.ms, bad: scores.badness(metric, chosen.of(cell).value), score: chosen.of(cell) }));
    const best = front(all).sort((a, b) => a.cost - b.cost);
    const log = metric.kind === "log";
    const label = (cell) => [cell.technique, scores.parameters(cell)].filter(Boolean).join(", ");
    points(host, {
      points: all.map((p) => ({
        x: p.cost, x0: p.cost, x1: p.cost, ...ends(p.score, metric, log), name: label(p.cell), colour: colour(p.cell),
        filled: best.includes(p), label: best.includes(p) ? p.cell.technique : "", shift: best.indexOf(p) % 2 ? 16 : -6,
        first: `${scores.number(p.score.value, metric.unit)} [${scores.interval(p.score, metric.unit)}]${p.score.open ? " ≈ inconclusive" : ""}`, second: `${scores.number(p.cost)} ms`,
      })),
      line: steps(best.map((p) => [p.cost, ends(p.score, metric, log).y])),
      x: "GPU time of one frame [ms]", y: scores.title(metric), xlog: true, ylog: log,
      says: `${metric.name} against GPU time: ${names[truth]}. On the front: ${best.map((p) => `${label(p.cell)}, ${scores.number(p.score.value, metric.unit)}, ${scores.number(p.cost)} ms`).join("; ")}`,
    });
    const sure = (p) => !all.some((q) => q !== p && q.cost <= p.cost && !apart(p, q, metric));
    document.getElementById("front").replaceChildren(...best.flatMap((p, i) => [i ? ", " : "On the front: ",
      element("a", { href: `cells/${encodeURIComponent(p.cell.slug)}.html` }, label(p.cell)),
      ` ${scores.number(p.score.value, metric.unit)} [${scores.interval(p.score, metric.unit)}] at ${scores.number(p.cost)} ms${sure(p) ? "" : " (undecided)"}`]), ".");
  }

  // Whether p is surely nearer to the truth than q.
  function apart(p, q, metric) {
    const worst = (s) => (metric.kind === "signed" ? Math.max(Math.abs(s.low), Math.abs(s.high)) : metric.kind === "log" ? s.high ?? Infinity : -(s.low ?? -Infinity));
    const least = (s) => (metric.kind === "signed" ? (s.low <= 0 && s.high >= 0 ? 0 : Math.min(Math.abs(s.low), Math.abs(s.high))) : metric.kind === "log" ? s.low ?? 0 : -(s.high ?? Infinity));
    return worst(p.score) < least(q.score);
  }

  const steps = (line) => line.flatMap(([x, y], i) => (i ? [[x, line[i - 1][1]], [x, y]] : [[x, y]]));

  // ---- when they are looked at ----
  function lazily(host, draw) {
    let seen = false;
    new IntersectionObserver((entries, observer) => {
      if (!entries.some((entry) => entry.isIntersecting)) return;
      observer.disconnect();
      seen = true;
      draw();
    }, { rootMargin: "200px" }).observe(host);
    return () => { if (seen) draw(); };
  }

  const choice = document.getElementById("truth");
  if (choice) {
    const again = lazily(document.getElementById("pareto"), pareto);
    choice.addEventListener("change", () => view.set({ truth: choice.value }));
    view.on(["metric", "region", "filter", "status", "truth"], again);
  }
  for (const host of document.querySelectorAll(".plot[data-figure]")) lazily(host, () => embed(host, host.dataset.figure, host.getAttribute("aria-label")));

  return { embed, lazily, points, ends, factor, colour: (k) => COLOURS[k % COLOURS.length] };
})();
