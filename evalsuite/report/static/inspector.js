// What is known of a pixel: both values with their noise, the error with its interval, the regions it is in.
"use strict";

const inspector = (() => {
  const root = document.querySelector(".inspector");
  const [across, down] = root ? root.querySelectorAll("input") : [];
  const body = root?.querySelector("tbody");
  const places = root?.querySelector(".places");
  const mark = document.querySelector(".viewer .pixel-mark");
  const names = root ? JSON.parse(root.dataset.regions) : []; // [number, name]
  const CHANNELS = [["R", [1, 0, 0]], ["G", [0, 1, 0]], ["B", [0, 0, 1]], ["luminance", [0.2126, 0.7152, 0.0722]]];
  let data = null;
  let hovered = null;

  // The pixel that was chosen; in none given the middle one stands in.
  function pinned() {
    const [x, y] = view.get("pixel").split(",").map(Number);
    return view.get("pixel") && Number.isInteger(x) && Number.isInteger(y) ? inside({ x, y }) : null;
  }

  const inside = ({ x, y }) => ({ x: Math.min(Math.max(x, 0), data.width - 1), y: Math.min(Math.max(y, 0), data.height - 1) });

  // [name, image, reference, its standard error, error, its standard error] of a pixel. Luminance takes channels as fully correlated.
  function values({ x, y }) {
    const { image, reference, sigma, own_sigma: own } = data.known;
    const at = y * data.width + x;
    const sum = (of, weights) => {
      if (!of) return null;
      const channels = of.length / (data.width * data.height);
      return weights.reduce((total, weight, c) => (weight ? total + weight * of[at * channels + (c % channels)] : total), 0);
    };
    return CHANNELS.map(([name, weights]) => {
      const [a, b, noise, drawn] = [image, reference, sigma, own].map((of) => sum(of, weights));
      const both = noise === null && drawn === null ? null : Math.hypot(noise ?? 0, drawn ?? 0);
      return { name, image: a, own: drawn, reference: b, sigma: noise, error: a === null || b === null ? null : a - b, both };
    });
  }

  function regions({ x, y }) {
    const where = data.known.where?.[y * data.width + x];
    if (where === undefined) return "";
    if (!(where & 1)) return "not on the scored object";
    const found = names.filter(([number]) => (where >> number) & 1).map(([, name]) => name);
    return found.length ? found.join(", ") : "on the object, in no region";
  }

  const pm = (value, noise) => (noise === null ? [value] : [value, ` ± ${digits.of(noise, 2)}`]);

  function show(pixel) {
    const at = pixel ?? { x: data.width >> 1, y: data.height >> 1 };
    if (document.activeElement !== across) across.value = at.x;
    if (document.activeElement !== down) down.value = at.y;
    places.textContent = regions(at);
    body.replaceChildren(...values(at).map((row) => {
      const line = document.createElement("tr");
      const head = document.createElement("th");
      head.scope = "row";
      head.textContent = row.name;
      const z = row.both > 0 && row.error !== null ? Math.abs(row.error) / row.both : null;
      const cells = [
        pm(digits.of(row.image), row.own), pm(digits.of(row.reference), row.sigma),
        row.error === null ? ["—"] : pm(digits.signed(row.error), row.both === null ? null : 1.96 * row.both),
        [z === null ? "—" : z >= 1000 ? "≥ 1000" : digits.of(z, 3)],
      ].map(([value, noise]) => {
        const cell = Object.assign(document.createElement("td"), { className: "num", textContent: value });
        if (noise) cell.append(Object.assign(document.createElement("span"), { textContent: noise }));
        return cell;
      });
      if (z !== null && z < 2) cells[3].className += " unsure";
      line.append(head, ...cells);
      return line;
    }));
    place(pixel);
  }

  // A frame about the pixel in the viewer.
  function place(pixel = hovered ?? pinned()) {
    mark.hidden = !pixel;
    if (!pixel) return;
    const [frame, around] = [book.frame().getBoundingClientRect(), mark.parentElement.getBoundingClientRect()];
    const [left, top] = [book.place.x + pixel.x * book.scale, book.place.y + pixel.y * book.scale];
    mark.hidden = left < -book.scale || top < -book.scale || left > frame.width || top > frame.height;
    Object.assign(mark.style, { left: `${frame.left - around.left + left}px`, top: `${frame.top - around.top + top}px`, width: `${book.scale}px`, height: `${book.scale}px` });
  }

  const pin = (pixel) => view.set({ pixel: `${pixel.x},${pixel.y}` });

  function under(event) {
    const at = book.pixelAt(event.clientX, event.clientY);
    const pixel = { x: Math.floor(at.x), y: Math.floor(at.y) };
    return pixel.x >= 0 && pixel.y >= 0 && pixel.x < data.width && pixel.y < data.height ? pixel : null;
  }

  function listen() {
    const frame = book.frame();
    let start = null;
    frame.addEventListener("pointerdown", (event) => { start = { x: event.clientX, y: event.clientY }; });
    frame.addEventListener("pointermove", (event) => {
      if (event.pointerType !== "mouse" || event.buttons) return;
      hovered = under(event);
      show(hovered ?? pinned());
    });
    frame.addEventListener("pointerleave", () => { hovered = null; show(pinned()); });
    // A press that moves nothing chooses; one of the main button or a finger.
    frame.addEventListener("pointerup", (event) => {
      if (!start || event.button || event.shiftKey || Math.hypot(event.clientX - start.x, event.clientY - start.y) > 4 || event.target.closest("button, input")) return;
      const pixel = under(event);
      if (pixel) pin(pixel);
    });
    for (const field of [across, down]) {
      field.addEventListener("change", () => {
        const pixel = inside({ x: Math.round(Number(across.value)), y: Math.round(Number(down.value)) });
        hovered = null;
        pin(pixel);
        [across.value, down.value] = [pixel.x, pixel.y];
      });
    }
  }

  return {
    start(all) {
      if (!root) return;
      data = all;
      [across.max, down.max] = [data.width - 1, data.height - 1];
      root.querySelector(".kept").textContent = `±${digits.of(50 * data.rounding[0], 2)} %`; // half a step of asinh, relative
      listen();
      book.on(() => place());
      view.on(["pixel"], () => show(pinned()));
      root.hidden = false;
      show(pinned());
    },
    move(x, y) {
      const from = pinned() ?? { x: data.width >> 1, y: data.height >> 1 };
      hovered = null;
      pin(inside({ x: from.x + x, y: from.y + y }));
      return false;
    },
    // The chosen pixel's middle as parts of the picture's size, where there is one.
    point() {
      const pixel = pinned();
      return pixel && { x: (pixel.x + 0.5) / data.width, y: (pixel.y + 0.5) / data.height };
    },
    get rounding() { return data.rounding; },
  };
})();
