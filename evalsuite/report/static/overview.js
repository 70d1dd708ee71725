// Filtering cells, sorting the table of all, opening cells, and the choices above the matrix. All text is in the page already.
"use strict";

(() => {
  const table = document.getElementById("summary");
  const heads = [...table.tHead.rows[0].cells];
  const body = table.tBodies[0];
  const rows = [...body.rows];
  const text = new Map(rows.map((row) => [row, row.textContent.toLowerCase()]));

  // ---- table ----
  function value(row, column) {
    // A reason spans the four score columns, so cells are counted by the columns they cover.
    let at = 0;
    for (const cell of row.cells) {
      at += cell.colSpan;
      if (at > column) return cell.dataset.value ?? "";
    }
    return "";
  }

  function sort() {
    const column = Number(view.get("column") || -1);
    const sign = view.get("columndown") ? -1 : 1;
    heads.forEach((head, k) => { if (head.hasAttribute("aria-sort")) head.setAttribute("aria-sort", k !== column ? "none" : sign > 0 ? "ascending" : "descending"); });
    const numeric = heads[column]?.classList.contains("num");
    const ordered = column < 0 ? rows : [...rows].sort((a, b) => {
      const [x, y] = [value(a, column), value(b, column)];
      if (x === "" || y === "") return (x === "") - (y === ""); // what has no score stays last either way
      return sign * (numeric ? Number(x) - Number(y) : x.localeCompare(y, undefined, { numeric: true }));
    });
    body.append(...ordered);
    remember();
  }

  heads.forEach((head, column) => {
    const descending = () => head.getAttribute("aria-sort") === "ascending";
    head.querySelector("button")?.addEventListener("click", () => view.set({ column: String(column), columndown: descending() ? "1" : "" }));
  });

  function filter() {
    const words = view.get("filter").toLowerCase().split(/\s+/).filter(Boolean);
    const status = view.get("status");
    scores.shown.clear();
    for (const row of rows) {
      row.hidden = !(words.every((word) => text.get(row).includes(word)) && (!status || row.dataset.status === status));
      if (!row.hidden) scores.shown.add(row.dataset.cell);
    }
    const count = scores.shown.size;
    document.getElementById("shown").textContent = count === rows.length ? `${count} cells` : `${count} of ${rows.length} cells`;
    remember();
  }

  body.addEventListener("click", (event) => {
    const row = event.target.closest("tr");
    if (row && !event.target.closest("a") && !String(getSelection())) open(row);
  });
  body.addEventListener("keydown", (event) => {
    const row = event.target.closest("tr");
    if (!row) return;
    if (event.key === "Enter") open(row);
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!step) return;
    const visible = [...body.rows].filter((r) => !r.hidden);
    visible[visible.indexOf(row) + step]?.focus();
    event.preventDefault();
  });

  // ---- choices ----
  // Each control shows one key of the view, and changes it.
  for (const [id, event] of [["filter", "input"], ["status", "change"], ["metric", "change"], ["region", "change"], ["target", "change"]]) {
    const control = document.getElementById(id);
    const own = control.value; // as the report has it
    const show = () => {
      control.value = view.get(id) || own;
      if (control.selectedIndex < 0) control.value = own;
    };
    control.addEventListener(event, () => view.set({ [id]: control.value === own ? "" : control.value }));
    view.on([id], () => { if (document.activeElement !== control) show(); });
    show();
  }

  const tabs = [...document.querySelectorAll(".views button")];
  function tab() {
    const own = view.get("view") === "table" ? "table" : "matrix";
    for (const button of tabs) {
      button.setAttribute("aria-selected", String(button.dataset.view === own));
      button.tabIndex = button.dataset.view === own ? 0 : -1;
      document.getElementById(button.getAttribute("aria-controls")).hidden = button.dataset.view !== own;
    }
  }
  for (const button of tabs) {
    button.addEventListener("click", () => view.set({ view: button.dataset.view === "table" ? "table" : "" }));
    button.addEventListener("keydown", (event) => {
      if (!["ArrowLeft", "ArrowRight"].includes(event.key)) return;
      const other = tabs[1 - tabs.indexOf(button)];
      other.click();
      other.focus();
    });
  }

  // ---- to and from cells ----
  // A cell's page goes through the cells in the order that is left here.
  function remember() {
    visit.write({ order: [...body.rows].filter((row) => !row.hidden).map((row) => row.dataset.cell) });
    view.remember();
  }

  function open(row) {
    location.href = row.querySelector("a[href]").href;
  }

  // Sections are gone to without leaving the view's address.
  document.addEventListener("click", (event) => {
    const link = event.target.closest('a[href^="#"]');
    const section = link && document.getElementById(link.getAttribute("href").slice(1));
    if (!section) return;
    event.preventDefault();
    section.scrollIntoView({ behavior: matchMedia("(prefers-reduced-motion: reduce)").matches ? "auto" : "smooth" });
    section.tabIndex = -1;
    section.focus({ preventScroll: true });
  });

  // Until 0.1 cells were parts of this page: index.html#<cell>.
  function redirect() {
    const slug = location.hash.slice(1);
    const row = rows.find((one) => one.dataset.cell === slug || encodeURIComponent(one.dataset.cell) === slug);
    if (row) location.replace(row.querySelector("a[href]").href);
  }

  window.addEventListener("hashchange", redirect);
  view.on(["filter", "status"], filter);
  view.on(["column", "columndown"], sort);
  view.on(["view"], tab);
  sort();
  filter();
  tab();
  rows.find((row) => row.dataset.cell === visit.read().cell && !row.hidden)?.focus();
  visit.write({ cell: null });
  redirect();
})();
