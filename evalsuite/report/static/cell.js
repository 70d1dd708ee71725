// The viewer of a cell's page. All text is in the page already; data is only ever pixels.
"use strict";

(() => {
  const section = document.querySelector(".cell");
  const slug = section.id;
  const viewer = section.querySelector(".viewer");
  const buttons = [...section.querySelectorAll(".strip button")];
  let host = null; // FlipBook's box

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

  // ---- viewer ----
  async function load() {
    const loading = viewer.querySelector(".loading");
    try {
      await view(await pixels.load(section));
      loading.hidden = true;
    } catch (error) {
      console.error(error);
      loading.textContent = "The pictures' data could not be loaded; the previews above remain.";
    }
  }

  async function view(data) {
    const values = data.pictures.map((picture) => picture.values);
    host = document.createElement("div");
    host.className = "book";
    host.id = `book-${slug}`;
    viewer.append(host);
    await flipbook.MakeFlipBook({
      dataUrls: values,
      types: values.map(() => "float32array"),
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
    while (host.querySelectorAll("canvas").length < values.length) await new Promise(requestAnimationFrame);
    settle(); // React has drawn by now
  }

  // The page's tab order instead of FlipBook's positive tab indices, names for its canvases, and a strip that follows its choice.
  function settle() {
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

  // ---- controls ----
  section.addEventListener("click", (event) => {
    const picture = event.target.closest(".strip button");
    if (picture && host) flipbook.UpdateFlipGroupSelection(slug, Number(picture.dataset.index));
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
    if (event.key === "Escape" && !document.fullscreenElement) location.href = section.querySelector("a.back").href;
    // FlipBook hears the keys of its own box only; the digits flip from anywhere on the page.
    const typing = event.target.closest?.("input, select, textarea") || event.ctrlKey || event.metaKey || event.altKey;
    if (host && !typing && /^[1-9]$/.test(event.key) && !host.contains(event.target)) {
      if (Number(event.key) <= host.querySelectorAll("canvas").length) flipbook.UpdateFlipGroupSelection(slug, Number(event.key) - 1);
    }
  });

  steps();
  section.querySelector("h1").focus({ preventScroll: true });
  if (viewer) load();
})();
