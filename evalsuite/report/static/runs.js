// Sorting and filtering of two runs side by side; what is chosen stands in the address, so that a view can be shared.
"use strict";

(() => {
  const table = document.getElementById("changes");
  if (!table) return;
  const body = table.tBodies[0];
  const rows = [...body.rows];
  const heads = [...table.tHead.rows[0].cells];
  const text = document.getElementById("filter");
  const verdict = document.getElementById("verdict");

  function sort(column, descending) {
    const numeric = heads[column].classList.contains("num") || column === 0; // verdicts in the order of the page
    heads.forEach((head, at) => head.setAttribute("aria-sort", at !== column ? "none" : descending ? "descending" : "ascending"));
    const sign = descending ? -1 : 1;
    const ordered = [...rows].sort((a, b) => {
      const [x, y] = [a, b].map((row) => row.cells[column].dataset.value);
      if (x === "" || y === "") return (x === "") - (y === ""); // what has no number stays last either way
      return sign * (numeric ? Number(x) - Number(y) : x.localeCompare(y, undefined, { numeric: true }));
    });
    body.append(...ordered);
  }

  function filter() {
    const words = text.value.toLowerCase().split(/\s+/).filter(Boolean);
    let count = 0;
    for (const row of rows) {
      const own = row.textContent.toLowerCase();
      row.hidden = !(words.every((word) => own.includes(word)) && (!verdict.value || row.dataset.verdict === verdict.value));
      count += !row.hidden;
      const pair = document.getElementById(row.dataset.cell);
      if (pair) pair.hidden = row.hidden;
    }
    document.getElementById("shown").textContent = count === rows.length ? `${count} cells` : `${count} of ${rows.length} cells`;
  }

  function remember(changed) {
    const state = new URLSearchParams(location.search);
    for (const [name, value] of Object.entries(changed)) value ? state.set(name, value) : state.delete(name);
    const query = String(state);
    history.replaceState(null, "", location.pathname + (query ? `?${query}` : "") + location.hash);
  }

  heads.forEach((head, column) => head.querySelector("button").addEventListener("click", () => {
    const descending = head.getAttribute("aria-sort") === "ascending";
    sort(column, descending);
    remember({ sort: `${descending ? "-" : ""}${column}` });
  }));
  for (const control of [text, verdict]) {
    control.addEventListener("input", () => { filter(); remember({ [control.id]: control.value }); });
  }

  const state = new URLSearchParams(location.search);
  text.value = state.get("filter") ?? "";
  if ([...verdict.options].some((option) => option.value === state.get("verdict"))) verdict.value = state.get("verdict");
  const [, minus, column] = /^(-?)(\d+)$/.exec(state.get("sort") ?? "") ?? [];
  if (column !== undefined && heads[column]) sort(Number(column), minus === "-");
  filter();
})();
