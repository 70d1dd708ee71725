// Sorting and filtering the table, and opening cells. All text is in the page already.
"use strict";

(() => {
  const table = document.getElementById("summary");
  const body = table.tBodies[0];
  const rows = [...body.rows];
  const search = document.getElementById("filter");
  const status = document.getElementById("status");

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

  function sort(column, head) {
    const numeric = head.classList.contains("num");
    const descending = head.getAttribute("aria-sort") === "ascending";
    for (const other of table.tHead.rows[0].cells) if (other.hasAttribute("aria-sort")) other.setAttribute("aria-sort", "none");
    head.setAttribute("aria-sort", descending ? "descending" : "ascending");
    const sign = descending ? -1 : 1;
    const ordered = [...rows].sort((a, b) => {
      const [x, y] = [value(a, column), value(b, column)];
      if (x === "" || y === "") return (x === "") - (y === ""); // what has no score stays last either way
      return sign * (numeric ? Number(x) - Number(y) : x.localeCompare(y, undefined, { numeric: true }));
    });
    body.append(...ordered);
    remember();
  }

  [...table.tHead.rows[0].cells].forEach((head, column) => {
    head.querySelector("button")?.addEventListener("click", () => sort(column, head));
  });

  function filter() {
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    let count = 0;
    for (const row of rows) {
      const text = row.textContent.toLowerCase();
      row.hidden = !(words.every((word) => text.includes(word)) && (!status.value || row.dataset.status === status.value));
      count += !row.hidden;
    }
    document.getElementById("shown").textContent = count === rows.length ? `${count} cells` : `${count} of ${rows.length} cells`;
    remember();
  }
  search.addEventListener("input", filter);
  status.addEventListener("change", filter);

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

  // ---- to and from cells ----
  // A cell's page goes through the cells in the order that is left here.
  function remember() {
    const sorted = table.querySelector("th[aria-sort=ascending], th[aria-sort=descending]");
    visit.write({
      order: [...body.rows].filter((row) => !row.hidden).map((row) => row.dataset.cell),
      sort: sorted && { column: sorted.cellIndex, descending: sorted.getAttribute("aria-sort") === "descending" },
      search: search.value,
      status: status.value,
    });
  }

  function open(row) {
    location.href = row.querySelector("a[href]").href;
  }

  function restore() {
    const left = visit.read();
    const head = left.sort && table.tHead.rows[0].cells[left.sort.column];
    if (head) {
      sort(left.sort.column, head);
      if (left.sort.descending) sort(left.sort.column, head);
    }
    search.value = left.search ?? "";
    status.value = left.status ?? "";
    if (status.selectedIndex < 0) status.value = "";
    filter();
    rows.find((row) => row.dataset.cell === left.cell && !row.hidden)?.focus();
    visit.write({ cell: null });
  }

  // Until 0.1 cells were parts of this page: index.html#<cell>.
  function redirect() {
    const slug = location.hash.slice(1);
    const row = rows.find((one) => one.dataset.cell === slug || encodeURIComponent(one.dataset.cell) === slug);
    if (row) location.replace(row.querySelector("a[href]").href);
  }

  window.addEventListener("hashchange", redirect);
  restore();
  redirect();
})();
