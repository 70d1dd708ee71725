// Sorting, filtering and opening cells. All text is in the page already; data is only ever pixels.
"use strict";

const evalsuite = (() => {
  const overview = document.getElementById("overview");
  const table = document.getElementById("summary");
  const body = table.tBodies[0];
  const rows = [...body.rows];
  const pending = new Map(); // slug → function that takes the cell's data
  let open = null; // { slug, timers, host }

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
  }

  [...table.tHead.rows[0].cells].forEach((head, column) => {
    head.querySelector("button")?.addEventListener("click", () => sort(column, head));
  });

  function filter() {
    const words = document.getElementById("filter").value.toLowerCase().split(/\s+/).filter(Boolean);
    const status = document.getElementById("status").value;
    let count = 0;
    for (const row of rows) {
      const text = row.textContent.toLowerCase();
      row.hidden = !(words.every((word) => text.includes(word)) && (!status || row.dataset.status === status));
      count += !row.hidden;
    }
    document.getElementById("shown").textContent = count === rows.length ? `${count} cells` : `${count} of ${rows.length} cells`;
  }
  document.getElementById("filter").addEventListener("input", filter);
  document.getElementById("status").addEventListener("change", filter);

  body.addEventListener("click", (event) => {
    const row = event.target.closest("tr");
    if (row && !event.target.closest("a") && !String(getSelection())) location.hash = row.dataset.cell;
  });
  body.addEventListener("keydown", (event) => {
    const row = event.target.closest("tr");
    if (!row) return;
    if (event.key === "Enter") location.hash = row.dataset.cell;
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!step) return;
    const visible = [...body.rows].filter((r) => !r.hidden);
    visible[visible.indexOf(row) + step]?.focus();
    event.preventDefault();
  });

  // ---- cells ----
  // FlipBook polls each picture with an interval that it never ends; those of a closed cell are ended here.
  const nativeInterval = window.setInterval.bind(window);
  window.setInterval = (...rest) => {
    const timer = nativeInterval(...rest);
    open?.timers.push(timer);
    return timer;
  };

  function close() {
    if (!open) return;
    open.timers.forEach(clearInterval);
    open.host?.remove();
    pending.delete(open.slug);
    const section = document.getElementById(open.slug);
    section.hidden = true;
    section.querySelectorAll(".strip button").forEach((b, i) => b.setAttribute("aria-pressed", String(i === 0)));
    section.querySelector(".loading")?.removeAttribute("hidden");
    open = null;
  }

  function show() {
    const slug = decodeURIComponent(location.hash.slice(1));
    const section = slug && document.getElementById(slug);
    const before = open?.slug;
    close();
    const isCell = Boolean(section && section.classList.contains("cell"));
    overview.hidden = isCell;
    if (!isCell) {
      if (before) rows.find((row) => row.dataset.cell === before)?.focus();
      return;
    }
    open = { slug, timers: [], host: null };
    section.hidden = false;
    neighbours(section, slug);
    scrollTo(0, 0);
    section.querySelector("h2").focus({ preventScroll: true });
    const viewer = section.querySelector(".viewer");
    if (viewer) load(slug, viewer);
  }

  // Previous and next in the order that the table shows.
  function neighbours(section, slug) {
    const order = [...body.rows].filter((row) => !row.hidden).map((row) => row.dataset.cell);
    for (const [rel, step] of [["prev", -1], ["next", 1]]) {
      const link = section.querySelector(`a[rel=${rel}]`);
      const other = order.includes(slug) ? order[order.indexOf(slug) + step] : undefined;
      link.hidden = other === undefined;
      if (other !== undefined) link.href = `#${other}`;
    }
  }

  function load(slug, viewer) {
    const loading = viewer.querySelector(".loading");
    const fail = () => { loading.textContent = "The pictures' data could not be loaded; the previews above remain."; };
    pending.set(slug, (data) => view(slug, viewer, data).then(() => { loading.hidden = true; }, (error) => { console.error(error); fail(); }));
    const script = document.createElement("script");
    script.src = `cells/${encodeURIComponent(slug)}.js`;
    script.onerror = fail;
    script.onload = () => script.remove();
    document.head.append(script);
  }

  // Half floats → Float32Array. FlipBook's own decoder flushes subnormals to zero.
  async function decode(base64) {
    const packed = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
    const count = bytes.length / 2;
    const out = new Float32Array(count);
    for (let i = 0; i < count; i++) {
      const bits = bytes[i] | (bytes[count + i] << 8);
      const exponent = (bits >> 10) & 31;
      const mantissa = bits & 1023;
      const magnitude = exponent === 0 ? mantissa * 2 ** -24 : exponent < 31 ? (1 + mantissa / 1024) * 2 ** (exponent - 15) : mantissa ? NaN : Infinity;
      out[i] = bits & 0x8000 ? -magnitude : magnitude;
    }
    return out;
  }

  async function view(slug, viewer, data) {
    const pixels = await Promise.all(data.pictures.map((picture) => decode(picture.data)));
    if (open?.slug !== slug) return;
    const host = document.createElement("div");
    host.className = "book";
    host.id = `book-${slug}`;
    viewer.append(host);
    open.host = host;
    await flipbook.MakeFlipBook({
      dataUrls: pixels,
      types: pixels.map(() => "float32array"),
      names: data.pictures.map((picture) => picture.name),
      width: data.width,
      height: data.height,
      containerId: host.id,
      id: host.id,
      groupName: slug,
      initialZoom: -1,
      initialTMO: { activeTMO: "exposure", exposure: 0 },
      initialTMOOverrides: data.pictures.map((picture) => picture.tmo),
      hideTools: true,
    });
    while (host.isConnected && host.querySelectorAll("canvas").length < pixels.length) await new Promise(requestAnimationFrame);
    settle(viewer, host); // React has drawn by now
  }

  // The page's tab order instead of FlipBook's positive tab indices, names for its canvases, and a strip that follows its choice.
  function settle(viewer, host) {
    const buttons = [...viewer.closest(".cell").querySelectorAll(".strip button")];
    const follow = () => {
      for (const element of host.querySelectorAll("[tabindex]")) if (element.tabIndex > 0) element.tabIndex = element.tabIndex === 2 ? 0 : -1;
      host.querySelectorAll("canvas").forEach((canvas, i) => {
        canvas.setAttribute("role", "img");
        canvas.setAttribute("aria-label", buttons[i].querySelector("img").alt);
        buttons[i].setAttribute("aria-pressed", String(getComputedStyle(canvas).display !== "none"));
      });
    };
    new MutationObserver(follow).observe(host, { subtree: true, childList: true, attributeFilter: ["class"] });
    follow();
  }

  document.addEventListener("click", (event) => {
    const picture = event.target.closest(".strip button");
    if (picture && open) {
      flipbook.UpdateFlipGroupSelection(open.slug, Number(picture.dataset.index));
    }
    const copy = event.target.closest(".copy");
    if (copy) copyText(copy);
  });

  async function copyText(button) {
    const code = button.previousElementSibling;
    try {
      await navigator.clipboard.writeText(code.textContent);
      button.textContent = "Copied";
    } catch { // not every browser lets a page from disk write the clipboard: select it for Ctrl+C
      getSelection().selectAllChildren(code);
      button.textContent = "Selected";
    }
    setTimeout(() => { button.textContent = "Copy"; }, 1500);
  }

  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && open && !document.fullscreenElement) location.hash = "";
    // FlipBook hears the keys of its own box only; the digits flip from anywhere on the cell.
    const typing = event.target.closest?.("input, select, textarea") || event.ctrlKey || event.metaKey || event.altKey;
    if (open?.host && !typing && /^[1-9]$/.test(event.key) && !open.host.contains(event.target)) {
      if (Number(event.key) <= open.host.querySelectorAll("canvas").length) flipbook.UpdateFlipGroupSelection(open.slug, Number(event.key) - 1);
    }
  });
  window.addEventListener("hashchange", show);
  show();

  return { receive: (slug, data) => { pending.get(slug)?.(data); pending.delete(slug); } };
})();
