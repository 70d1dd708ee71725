// What the viewer of a cell's page is told, by keys, buttons and the address, and what it tells them.
"use strict";

const viewer = (() => {
  const section = document.querySelector(".cell");
  const box = section.querySelector(".viewer");
  const buttons = [...section.querySelectorAll(".strip button")];
  const tools = section.querySelector(".tools");
  let pictures = [];
  let wanted = null; // the view of the address while the picture is still on its way there

  // ---- the view and the address ----
  const whole = { zoom: 1, x: 0.5, y: 0.5 };
  // But for a pixel of the screen.
  const same = (a, b) => Math.abs(a.zoom / b.zoom - 1) < 1e-3
    && Math.abs(a.x - b.x) * book.size.width * book.scale < 1 && Math.abs(a.y - b.y) * book.size.height * book.scale < 1;

  function asked() {
    const [x, y] = view.get("at").split(",").map(Number);
    const zoom = Number(view.get("zoom")) || 1;
    const within = (value) => Math.min(Math.max(value, 0), 1);
    return view.get("at") && Number.isFinite(x + y) ? { zoom, x: within(x), y: within(y) } : { ...whole, zoom };
  }

  function restore() {
    const index = pictures.findIndex((picture) => picture.key === view.get("picture"));
    if (Math.max(index, 0) !== book.selected) book.select(Math.max(index, 0));
    wanted = book.look(asked());
    swipe.restore();
  }

  // FlipBook's choice and view into the address, and the page's tab order instead of its positive tab indices.
  function follow() {
    for (const element of box.querySelectorAll("[tabindex]")) if (element.tabIndex > 0) element.tabIndex = element.tabIndex === 2 ? 0 : -1;
    book.canvases().forEach((canvas, i) => {
      canvas.setAttribute("role", "img");
      canvas.setAttribute("aria-label", buttons[i].querySelector("img").alt);
      buttons[i].setAttribute("aria-pressed", String(i === book.selected));
    });
    const now = book.view();
    box.classList.toggle("zoomed", now.zoom > 1.001);
    if (wanted && !same(now, wanted)) return;
    wanted = null;
    if (same(now, asked())) return;
    const [zoom, x, y] = [now.zoom, now.x, now.y].map((value) => String(Number(value.toFixed(4))));
    view.set({ zoom: zoom === "1" ? "" : zoom, at: same({ ...now, zoom: 1 }, whole) ? "" : `${x},${y}` });
  }

  function show(index) {
    const next = (index + pictures.length) % pictures.length;
    book.select(next);
    view.set({ picture: next ? pictures[next].key : "" });
  }

  // A click on FlipBook's own list or its keys chooses as well.
  function chosen() {
    const key = book.selected ? pictures[book.selected].key : "";
    const known = pictures.some((picture) => picture.key === view.get("picture")) ? view.get("picture") : "";
    if (!wanted && key !== known) view.set({ picture: key });
  }

  // ---- keys ----
  const typing = (target) => target.closest?.("input:not([type=range], [type=checkbox]), select, textarea");

  // name of a key → what it does; true where it did nothing.
  function act(event) {
    const { key, code, shiftKey: shift } = event;
    const number = /^(?:Digit|Numpad)(\d)$/.exec(code);
    if (number) {
      const index = (Number(number[1]) || 10) - 1 + (shift ? 10 : 0);
      return index < pictures.length ? show(index) : true;
    }
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[key];
    if (arrow && shift) return inspector.move(...arrow);
    if (arrow && (arrow[0] || box.contains(event.target))) return event.target.type === "range" || show(book.selected + arrow[0] + arrow[1]);
    switch (key) {
      case "e": return exposure.step(0.5);
      case "E": return exposure.step(-0.5);
      case "f": case "F": return exposure.toggle();
      case "+": case "=": return book.zoom(1.25);
      case "-": return book.zoom(1 / 1.25);
      case "r": return book.look(whole);
      case "s": return swipe.toggle();
      case "[": return swipe.move(-2);
      case "]": return swipe.move(2);
      case "?": tools.querySelector(".keys").toggleAttribute("open"); return false;
      default: return true;
    }
  }

  function keys() {
    document.addEventListener("keydown", (event) => {
      if (typing(event.target) || event.ctrlKey || event.metaKey || event.altKey || act(event) === true) return;
      event.preventDefault();
      event.stopPropagation(); // FlipBook has some of these as well
    }, { capture: true });
  }

  // ---- buttons and fingers ----
  section.addEventListener("click", (event) => {
    const picture = event.target.closest(".strip button");
    if (picture && pictures.length) show(Number(picture.dataset.index));
    switch (event.target.closest(".tools button")?.name) {
      case "brighter": return exposure.step(0.5);
      case "darker": return exposure.step(-0.5);
      case "nearer": return book.zoom(1.25, inspector.point());
      case "farther": return book.zoom(1 / 1.25, inspector.point());
      case "fit": return book.look(whole);
      default: return undefined;
    }
  });

  // FlipBook knows the mouse alone: two fingers zoom, one moves what does not fit.
  function fingers() {
    const down = new Map();
    const spread = () => { const [a, b] = [...down.values()]; return { size: Math.hypot(a.x - b.x, a.y - b.y), x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 }; };
    const part = (at) => { const p = book.pixelAt(at.x, at.y); return { x: p.x / book.size.width, y: p.y / book.size.height }; };
    box.addEventListener("pointerdown", (event) => { if (event.pointerType === "touch") down.set(event.pointerId, { x: event.clientX, y: event.clientY }); });
    for (const name of ["pointerup", "pointercancel", "pointerleave"]) box.addEventListener(name, (event) => down.delete(event.pointerId));
    box.addEventListener("pointermove", (event) => {
      const before = down.get(event.pointerId);
      if (!before || event.target.closest(".split")) return;
      const after = { x: event.clientX, y: event.clientY };
      const old = down.size === 2 ? spread() : null;
      down.set(event.pointerId, after);
      if (old) {
        const now = spread();
        book.zoom(now.size / Math.max(old.size, 1), part(now));
      } else if (down.size === 1 && box.classList.contains("zoomed")) {
        const at = book.view();
        const per = { x: book.size.width * book.scale, y: book.size.height * book.scale };
        book.look({ ...at, x: at.x - (after.x - before.x) / per.x, y: at.y - (after.y - before.y) / per.y });
      }
    });
  }

  return {
    start(data) {
      ({ pictures } = data);
      exposure.start(pictures);
      swipe.start(pictures);
      inspector.start(data);
      histogram.start(data);
      book.on(follow);
      book.on(chosen);
      window.addEventListener("hashchange", restore);
      restore();
      keys();
      fingers();
      tools.querySelector(".keys").open = matchMedia("(min-width: 64rem)").matches;
      tools.hidden = false;
    },
  };
})();
