// Two pictures side by side at one place: FlipBook draws all of them, in step; here the second is laid over the first and cut off.
"use strict";

const swipe = (() => {
  const line = document.querySelector(".viewer .split");
  const range = document.getElementById("split");
  const choice = document.getElementById("swipe");
  let pictures = [];

  // The split is a part of the box's width, so that it stays in sight however the picture is moved.
  function draw() {
    const other = pictures.findIndex((picture) => picture.key === choice.value);
    const on = other >= 0;
    const at = Number(range.value) / 100;
    range.disabled = line.hidden = !on;
    book.canvases().forEach((canvas, i) => { canvas.toggleAttribute("data-swipe", on && i === other && i !== book.selected); });
    if (!on) return;
    const frame = book.frame();
    const part = (at * frame.clientWidth - book.place.x) / (book.size.width * book.scale);
    frame.style.setProperty("--split", `${100 * Math.min(Math.max(part, 0), 1)}%`);
    const [box, around] = [frame.getBoundingClientRect(), line.parentElement.getBoundingClientRect()];
    line.style.left = `${box.left - around.left + at * box.width}px`;
    line.style.top = `${box.top - around.top}px`;
    line.style.height = `${frame.clientHeight}px`;
    line.dataset.left = pictures[book.selected].name;
    line.dataset.right = pictures[other].name;
    range.setAttribute("aria-valuetext", `${range.value} % ${line.dataset.left}, then ${line.dataset.right}`);
  }

  function put() {
    view.set({ swipe: choice.value, split: choice.value && range.value !== "50" ? range.value : "" });
    draw();
  }

  // The pointer takes the line along.
  line.addEventListener("pointerdown", (event) => {
    line.setPointerCapture(event.pointerId);
    event.preventDefault();
  });
  line.addEventListener("pointermove", (event) => {
    if (!line.hasPointerCapture(event.pointerId)) return;
    const box = book.frame().getBoundingClientRect();
    range.value = Math.min(Math.max(100 * (event.clientX - box.left) / box.width, 0), 100);
    put();
  });
  range.addEventListener("input", put);
  choice.addEventListener("change", put);

  function restore() {
    choice.value = pictures.some((picture) => picture.key === view.get("swipe")) ? view.get("swipe") : "";
    range.value = view.get("split") || 50;
    draw();
  }

  return {
    start(all) {
      pictures = all;
      for (const picture of all) choice.add(new Option(picture.name, picture.key));
      book.on(draw);
      restore();
    },
    restore,
    // On against the reference (of the reference: against the image), or off.
    toggle() {
      const usual = pictures[book.selected].key === "reference" ? "image" : "reference";
      choice.value = choice.value ? "" : usual;
      put();
    },
    move(step) {
      if (range.disabled) return;
      range.value = Number(range.value) + step;
      put();
    },
  };
})();
