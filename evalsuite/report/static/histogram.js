// How the pixels' errors are distributed, over the object or a region of it, beside what noise alone would give.
"use strict";

const histogram = (() => {
  const BINS = 61; // odd: one about 0
  const host = document.getElementById("histogram");
  const choice = document.getElementById("histogram-region");
  const says = document.getElementById("histogram-says");
  const luminance = (values, i) => 0.2126 * values[3 * i] + 0.7152 * values[3 * i + 1] + 0.0722 * values[3 * i + 2];

  // Φ by Abramowitz and Stegun 7.1.26, good to 1e-7.
  function below(z) {
    const t = 1 / (1 + 0.3275911 * Math.abs(z) / Math.SQRT2);
    const erf = 1 - t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429)))) * Math.exp(-z * z / 2);
    return z < 0 ? (1 - erf) / 2 : (1 + erf) / 2;
  }

  // Round number (1, 2, 5 × 10ⁿ) that is not smaller.
  function nice(value) {
    const power = 10 ** Math.floor(Math.log10(value));
    return [1, 2, 5, 10].find((m) => m * power >= value * 0.999) * power;
  }

  // Relative errors of luminance of the pixels that are in a region (0: the whole object), and their standard errors.
  function errors({ known, width, height, epsilon }, region) {
    const { image, reference, sigma, own_sigma: own, where } = known;
    const found = { error: [], noise: [] };
    for (let i = 0; i < width * height; i++) {
      if (where && (!(where[i] & 1) || (region && !((where[i] >> region) & 1)))) continue;
      const truth = Math.max(luminance(reference, i), 0) + epsilon;
      const value = (luminance(image, i) - luminance(reference, i)) / truth;
      if (!Number.isFinite(value)) continue;
      found.error.push(value);
      found.noise.push(sigma ? Math.hypot(luminance(sigma, i), own ? luminance(own, i) : 0) / truth : 0);
    }
    return found;
  }

  // { edges, errors: part of the pixels in each bin, noise: the same of errors that are noise alone, out: [below, above] }
  function count({ error, noise }) {
    const sorted = [...error.map(Math.abs)].sort((a, b) => a - b);
    const typical = [...noise].sort((a, b) => a - b)[noise.length >> 1] ?? 0;
    const end = nice(Math.max(sorted[Math.floor(0.99 * (sorted.length - 1))] ?? 0, 4 * typical, 1e-4));
    const edges = Array.from({ length: BINS + 1 }, (_, k) => (2 * k / BINS - 1) * end);
    const [of, alone, out] = [new Array(BINS).fill(0), new Array(BINS).fill(0), [0, 0]];
    const one = 1 / Math.max(error.length, 1);
    for (const value of error) {
      const k = Math.floor((value / end + 1) / 2 * BINS);
      if (k < 0) out[0] += one; else if (k >= BINS) out[1] += one; else of[k] += one;
    }
    const stride = Math.ceil(noise.length / 20000); // the sum of many bells is smooth
    for (let i = 0; i < noise.length; i += stride) {
      const width = Math.max(noise[i], 1e-12);
      let before = below(edges[0] / width);
      for (let k = 0; k < BINS; k++) {
        const after = below(edges[k + 1] / width);
        alone[k] += (after - before) * stride * one;
        before = after;
      }
    }
    return { edges, errors: of, noise: alone, out };
  }

  function draw(data) {
    const region = Number(choice.value);
    const name = choice.selectedOptions[0].textContent;
    const found = errors(data, region);
    const bins = count(found);
    const percent = (value) => `${digits.of(100 * value, 3)} %`;
    const style = (k) => (bins.edges[k] + bins.edges[k + 1] > 1e-9 ? "#d9772b" : bins.edges[k] + bins.edges[k + 1] < -1e-9 ? "#3b8ed0" : "#9a9a9a");
    const surely = found.error.filter((value, i) => Math.abs(value) > 1.96 * found.noise[i]).length / Math.max(found.error.length, 1);
    says.textContent = `${name}: ${found.error.length} pixels; ${percent(surely)} of them are wrong by more than 1.96 standard errors, where noise alone gives 5 %. `
      + `Beyond the ends: ${percent(bins.out[0])} too dark, ${percent(bins.out[1])} too bright.`;
    drawn = { region, ...bins };
    return plots.embed(host, "histogram", `Histogram of relative errors. ${says.textContent}`, {
      errors: {
        left: bins.edges.slice(0, -1).map((x) => 100 * x), right: bins.edges.slice(1).map((x) => 100 * x), top: bins.errors.map((y) => 100 * y),
        colour: bins.errors.map((_, k) => style(k)), says: bins.errors.map((_, k) => `${digits.signed(100 * bins.edges[k], 3)} … ${digits.signed(100 * bins.edges[k + 1], 3)} %`),
      },
      noise: { x: bins.edges.map((x) => 100 * x), y: [...bins.noise, 0].map((y) => 100 * y) },
      "x-axis": "(image − reference) / reference, luminance [%]",
    });
  }

  let drawn = null;
  return {
    start(data) {
      if (!host || !data.known.reference || data.known.reference.length !== 3 * data.width * data.height) return;
      const restore = () => { choice.value = [...choice.options].some((o) => o.textContent === view.get("region")) ? [...choice.options].find((o) => o.textContent === view.get("region")).value : "0"; };
      restore();
      const again = plots.lazily(host, () => draw(data));
      choice.addEventListener("change", () => view.set({ region: choice.value === "0" ? "" : choice.selectedOptions[0].textContent }));
      view.on(["region"], () => { restore(); again(); });
    },
    get drawn() { return drawn; },
  };
})();
