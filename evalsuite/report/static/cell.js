// A cell's page: its steps to other cells, its pictures and its command. All text is in the page already; data is only ever pixels.
"use strict";

(() => {
  const section = document.querySelector(".cell");
  const slug = section.id;
  const box = section.querySelector(".viewer");

  // ---- steps ----
  // Previous and next in the order that the overview shows; without its word the links stay those of the report's order.
  function steps() {
    const { order } = visit.read();
    visit.write({ cell: slug });
    if (!Array.isArray(order) || !order.includes(slug)) return;
    for (const [rel, step] of [["prev", -1], ["next", 1]]) {
      const link = section.querySelector(`a[rel=${rel}]`);
      const other = order[order.indexOf(slug) + step];
      link.hidden = other === undefined;
      if (other !== undefined) link.href = `${encodeURIComponent(other)}.html`;
    }
  }

  // Picture, zoom and exposure come along: the next cell opens as this one is looked at.
  const STAY = ["pixel"];
  function along() {
    const kept = new URLSearchParams(view.all());
    for (const key of STAY) kept.delete(key);
    for (const link of section.querySelectorAll("a[rel=prev], a[rel=next]")) {
      if (link.hasAttribute("href")) link.href = link.href.split("#")[0] + (kept.size ? `#?${kept}` : "");
    }
  }

  // ---- pictures ----
  // A virtual machine, a hardened browser: FlipBook would stay black there without a word.
  function drawable() {
    const context = document.createElement("canvas").getContext("webgl2");
    context?.getExtension("WEBGL_lose_context")?.loseContext();
    return context !== null;
  }

  // The previews in the viewer's place, chosen in the strip.
  function stills() {
    const buttons = [...section.querySelectorAll(".strip button")];
    const still = document.createElement("img");
    still.className = "still";
    box.prepend(still);
    const show = (index) => {
      const preview = buttons[index].querySelector("img");
      still.src = preview.src;
      still.alt = preview.alt;
      buttons.forEach((button, i) => button.setAttribute("aria-pressed", String(i === index)));
    };
    buttons.forEach((button, i) => button.addEventListener("click", () => show(i)));
    show(0);
  }

  async function load() {
    const loading = box.querySelector(".loading");
    if (!drawable()) {
      stills();
      loading.textContent = "This browser offers no WebGL 2: previews only. The run's EXR files open in tev and others.";
      return;
    }
    try {
      const data = await pixels.load(section);
      const host = document.createElement("div");
      host.className = "book";
      host.id = `book-${slug}`;
      box.prepend(host);
      await book.open(host, data);
      viewer.start(data);
      loading.hidden = true;
    } catch (error) {
      console.error(error);
      loading.textContent = "The pictures' data could not be loaded; the previews above remain.";
    }
  }

  // ---- command and keys ----
  section.addEventListener("click", async (event) => {
    const button = event.target.closest(".copy");
    if (!button) return;
    const code = button.previousElementSibling;
    try {
      await navigator.clipboard.writeText(code.textContent);
      button.textContent = "Copied";
    } catch { // not every browser lets a page from disk write the clipboard: select it for Ctrl+C
      getSelection().selectAllChildren(code);
      button.textContent = "Selected";
    }
    setTimeout(() => { button.textContent = "Copy"; }, 1500);
  });

  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.("input:not([type=range], [type=checkbox]), select, textarea")) return;
    if (event.key === "Escape" && !document.fullscreenElement) location.href = section.querySelector("a.back").href;
    const step = { n: "next", p: "prev" }[event.key];
    const link = step && section.querySelector(`a[rel=${step}]:not([hidden])`);
    if (link) location.href = link.href;
  });

  // ---- what scrolls can be reached by keys ----
  function scrollable() {
    for (const box of section.querySelectorAll(".scroll")) {
      if (box.scrollWidth > box.clientWidth) {
        box.tabIndex = 0;
        box.setAttribute("role", "region");
        box.setAttribute("aria-label", box.closest("section").querySelector("h3, h1")?.textContent.trim().replace(/\s+/g, " ") ?? "Table");
      } else for (const name of ["tabindex", "role", "aria-label"]) box.removeAttribute(name);
    }
  }
  new ResizeObserver(scrollable).observe(section);
  section.addEventListener("toggle", scrollable, { capture: true });

  steps();
  view.on(null, along);
  along();
  section.querySelector("h1").focus({ preventScroll: true });
  if (box) load();
})();
