// One cell over the checks, with axes; the choice and the filter stand in the address, so that a view can be shared.
"use strict";

(() => {
  const section = document.getElementById("trend");
  if (!section) return;
  const data = JSON.parse(document.getElementById("data").textContent);
  const rows = [...document.querySelectorAll("#series tbody tr")];
  const buttons = rows.map((row) => row.querySelector(".spark button"));
  const names = rows.map((row) => row.dataset.name);
  const text = document.getElementById("filter");
  const host = section.querySelector(".plot");

  // The columns of the plot's sources.
  function columns({ check, verdict, y, low, high, levels, changes }) {
    const at = check.map((place) => data.checks[place]);
    const ends = (k) => (low[k] === high[k] && low[k] !== null ? "no interval" : `${low[k] ?? "−∞"} … ${high[k] ?? "∞"}`);
    return {
      points: {
        x: at.map(([number]) => number), y, y0: low.map((v, k) => v ?? y[k]), y1: high.map((v, k) => v ?? y[k]),
        check: at.map(([number]) => `${number}`), created: at.map(([, created]) => created), commit: at.map(([, , commit]) => commit),
        verdict: verdict.map((v) => data.verdicts[v]), value: y.map((v, k) => `${v} % [${ends(k)}]`),
      },
      levels: {
        x0: levels.map(([first]) => first - 0.4), x1: levels.map(([, last]) => last + 0.4),
        y: levels.map((v) => v[2]), low: levels.map((v) => v[3]), high: levels.map((v) => v[4]),
      },
      changes: { x: changes },
    };
  }

  function show(k) {
    buttons.forEach((button, at) => button.setAttribute("aria-pressed", String(at === k)));
    const row = rows[k];
    document.getElementById("trend-head").textContent = (row.querySelector(".cell-id a") ?? row.querySelector(".cell-id").firstChild).textContent.trim();
    document.getElementById("trend-renderer").textContent = row.querySelector(".cell-id small")?.textContent ?? "";
    const said = [...row.querySelectorAll(".said p")].map((p) => p.textContent);
    document.getElementById("trend-said").replaceChildren(...said.map((words) => {
      const item = document.createElement("li");
      item.textContent = words;
      return item;
    }));
    plots.embed(host, "trend", `rel_rmse of ${names[k]} over the checks, with 95 % intervals. ${said.join(" ") || "No change of level."}`, columns(data.series[k]));
  }

  function filter() {
    const words = text.value.toLowerCase().split(/\s+/).filter(Boolean);
    let count = 0;
    for (const [k, row] of rows.entries()) {
      const own = `${row.textContent} ${data.series[k].check.map((place) => data.checks[place][2]).join(" ")}`.toLowerCase();
      row.hidden = !words.every((word) => own.includes(word));
      count += !row.hidden;
    }
    document.getElementById("shown").textContent = `${count === rows.length ? "" : `${count} of `}${rows.length} row${rows.length === 1 ? "" : "s"}`;
  }

  function remember(changed) {
    const state = new URLSearchParams(location.search);
    for (const [name, value] of Object.entries(changed)) value ? state.set(name, value) : state.delete(name);
    const query = String(state);
    history.replaceState(null, "", location.pathname + (query ? `?${query}` : ""));
  }

  for (const [k, button] of buttons.entries()) {
    button.addEventListener("click", () => {
      show(k);
      remember({ cell: names[k] });
      const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
      section.scrollIntoView({ block: "nearest", behavior: still ? "auto" : "smooth" });
    });
  }
  text.addEventListener("input", () => { filter(); remember({ filter: text.value }); });

  const state = new URLSearchParams(location.search);
  text.value = state.get("filter") ?? "";
  filter();
  show(Math.max(0, names.indexOf(state.get("cell"))));
})();
