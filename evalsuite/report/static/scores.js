// The overview's data, what of it is chosen, its numbers as words and its colours. Numbers read as in report/numbers.py.
"use strict";

const scores = (() => {
  const data = JSON.parse(document.getElementById("scores").textContent);
  const metrics = data.metrics.map(([name, unit, says, kind]) => ({ name, unit, says, kind }));
  const dark = matchMedia("(prefers-color-scheme: dark)");

  // ---- what is chosen ----
  function chosen() {
    const m = Math.max(0, metrics.findIndex((one) => one.name === view.get("metric")));
    const r = Math.max(0, data.regions.indexOf(view.get("region")));
    const target = data.targets.includes(view.get("target")) ? view.get("target") : data.targets[0];
    const of = (cell) => {
      const found = cell.scores[r]?.[m];
      return found ? { value: found[0], low: found[1], high: found[2], open: found[3] === 1 } : null;
    };
    return { metric: metrics[m], region: data.regions[r], target, of };
  }

  // ---- words ----
  function number(value, unit = "", digits = 3, resolve = 0) {
    if (value === null || !Number.isFinite(value)) return "—";
    const factor = unit === "%" ? 100 : 1;
    const magnitude = Math.abs(value) * factor;
    let text = "0";
    if (magnitude >= 1e-3 && magnitude < 1e5) {
      let decimals = digits - 1 - Math.floor(Math.log10(magnitude));
      if (resolve > 0) decimals = Math.max(decimals, Math.min(-Math.floor(Math.log10(resolve * factor)), 6));
      text = magnitude.toFixed(Math.max(0, decimals));
    } else if (magnitude > 0) {
      text = magnitude.toExponential(digits - 1).replace(/e([+-])(\d)$/, "e$10$2");
    }
    return (value < 0 && Number(text) ? "−" : "") + text + (unit ? ` ${unit}` : "");
  }

  function interval(score, unit = "") {
    const { low, high } = score;
    if (low !== null && low === high) return "no interval";
    const width = low !== null && high !== null ? high - low : 0;
    const [first, last] = [low, high].map((end) => number(end, unit, 3, width).replace(` ${unit}`, ""));
    return `${low === null ? "−∞" : first} … ${high === null ? "∞" : last}`;
  }

  const parameters = (cell) => Object.entries(cell.parameters).map(([name, value]) => `${name} ${value}`).join(", ");
  const title = (metric) => `${metric.name}${metric.unit ? ` [${metric.unit}]` : ""}`;

  // ---- how far from the truth: larger is worse ----
  function badness(metric, value) {
    if (metric.kind === "signed") return Math.abs(value);
    return metric.kind === "gain" || metric.kind === "likeness" ? -value : value;
  }

  // ---- colours ----
  const down = (v) => { const p = 10 ** Math.floor(Math.log10(v) + 1e-9); return [5, 2, 1].map((m) => m * p).find((n) => n <= v * 1.000001) ?? p; };
  const up = (v) => { const p = 10 ** Math.floor(Math.log10(v) - 1e-9); return [1, 2, 5, 10].map((m) => m * p).find((n) => n >= v * 0.999999) ?? 10 * p; };

  function decades(low, high) {
    const found = [];
    for (const steps of [[1], [1, 2, 5]]) {
      found.length = 0;
      for (let n = Math.floor(Math.log10(low)); n <= Math.log10(high) + 1e-9; n++) for (const s of steps) found.push(Number(`${s}e${n}`));
      if (found.filter((v) => v > low * 0.999 && v < high * 1.001).length > 2) break;
    }
    return found.filter((v) => v > low * 0.999 && v < high * 1.001);
  }

  // position: 0 right, 1 as wrong as the scale goes; of signed metrics 0 too dark, 1 too bright. ticks: [position, label].
  function scale(metric, values) {
    const label = (value) => number(value, metric.unit, 1).replace(/\.0+(?=\D|$)/, "");
    const clamp = (t) => Math.min(1, Math.max(0, t));
    let position, ticks, says;
    if (metric.kind === "signed") {
      const limit = up(Math.max(1e-12, ...values.map(Math.abs)));
      const knee = limit / 1000;
      position = (v) => clamp(0.5 + (0.5 * Math.sign(v) * Math.log1p(Math.abs(v) / knee)) / Math.log1p(limit / knee));
      ticks = [-1, -0.1, -0.01, 0, 0.01, 0.1, 1].map((k) => [position(k * limit), (k > 0 ? "+" : "") + label(k * limit)]);
      says = "blue: too dark, red: too bright";
    } else if (metric.kind === "gain") {
      const [low, high] = [Math.min(...values, Infinity), Math.max(...values, -Infinity)].map((v, i) => (Number.isFinite(v) ? 10 * Math[i ? "ceil" : "floor"](v / 10) : 10 * i));
      position = (v) => clamp((high - v) / (high - low || 1));
      ticks = [0, 0.25, 0.5, 0.75, 1].map((t) => [t, number(high - t * (high - low), metric.unit, 2)]);
      says = "more is better";
    } else {
      const away = metric.kind === "likeness" ? (v) => 1 - v : (v) => v;
      const some = values.map(away).filter((v) => v > 0);
      const high = up(Math.max(...some, 1e-12));
      const least = down(Math.min(...some, high / 10));
      const low = Math.max(least, high / 1e3);
      position = (v) => (away(v) > 0 ? clamp(Math.log(away(v) / low) / Math.log(high / low)) : 0);
      const end = (v) => (metric.kind === "likeness" ? String(Number((1 - v).toPrecision(6))) : label(v));
      ticks = decades(low, high).map((v) => [position(away(v)), end(v)]);
      if (low > least) ticks = [[0, `${metric.kind === "likeness" ? "≥" : "≤"} ${end(low)}`], ...ticks.filter(([at]) => at > 0.12)];
      says = metric.kind === "likeness" ? "1 is alike" : "less is better";
    }
    const stops = metric.kind === "signed" ? data.diverging : dark.matches ? data.ramp : [...data.ramp].reverse();
    return { position, ticks, says, colour: (value) => mix(stops, position(value)), stops };
  }

  // Linear in sRGB between equidistant stops, as CSS gradients are.
  function mix(stops, t) {
    const at = t * (stops.length - 1), k = Math.min(Math.floor(at), stops.length - 2);
    return stops[k].map((c, i) => Math.round(c + (at - k) * (stops[k + 1][i] - c)));
  }

  const css = (rgb) => `rgb(${rgb.join(", ")})`;
  const luminance = (rgb) => rgb.map((c) => c / 255).map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4)).reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
  const ink = (rgb) => (luminance(rgb) > 0.179 ? "#000" : "#fff"); // either is at least 4.5 to 1 there

  return { data, metrics, chosen, number, interval, parameters, title, badness, scale, css, ink, dark, shown: new Set(data.cells.map((cell) => cell.slug)) };
})();

// Elements by name, with attributes and children; text is only ever text.
function element(name, attributes = {}, ...children) {
  const svg = ["svg", "g", "path", "line", "circle", "polyline", "title"].includes(name);
  const made = svg ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) if (value !== null && value !== undefined && value !== false) made.setAttribute(key, value === true ? "" : value);
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}
