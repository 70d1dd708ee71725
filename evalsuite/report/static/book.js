// FlipBook in a cell's page. What it does but does not export, its choice, view and tone mapping, are React components: they are
// found from a canvas that they drew.
"use strict";

const book = (() => {
  const LARGEST = 200; // CSS pixels a pixel
  const listeners = [];
  let host = null;
  let shell = null; // FlipBook
  let last = null; // the view before the box changed its size
  let coming = null; // the view that was asked for and that React has not drawn yet
  let size = { width: 1, height: 1 };

  function component(element, property) {
    let fiber = element[Object.keys(element).find((key) => key.startsWith("__reactFiber$"))];
    while (fiber && !(fiber.stateNode && property in fiber.stateNode)) fiber = fiber.return;
    if (!fiber) throw new Error(`FlipBook has no ${property}`);
    return fiber.stateNode;
  }

  // data: as of pixels.load. Fills the box and resolves when all pictures have their canvas.
  async function open(box, data) {
    host = box;
    ({ width: size.width, height: size.height } = data);
    const values = data.pictures.map((picture) => picture.values);
    await flipbook.MakeFlipBook({
      dataUrls: values,
      types: values.map(() => "float32array"),
      names: data.pictures.map((picture) => picture.name),
      width: data.width,
      height: data.height,
      containerId: host.id,
      id: host.id,
      groupName: host.id,
      initialZoom: -1,
      initialTMO: { activeTMO: "exposure", exposure: 0 },
      initialTMOOverrides: data.pictures.map((picture) => picture.tmo),
      hideTools: true,
    });
    while (canvases().length < values.length) await new Promise(requestAnimationFrame);
    shell = component(canvases()[0], "tmoCtrls");
    while (!shell.imageContainer.current?.container.current) await new Promise(requestAnimationFrame);
    new MutationObserver(tell).observe(host, { subtree: true, childList: true, attributeFilter: ["class", "style"] });
    new ResizeObserver(() => { if (last) look(last); }).observe(frame());
  }

  const canvases = () => [...host.querySelectorAll("canvas")];
  const frame = () => shell.imageContainer.current.container.current;
  const fit = () => Math.min(frame().clientWidth / size.width, frame().clientHeight / size.height);

  function tell() {
    last = coming ?? view();
    for (const call of listeners) call();
  }

  // zoom: 1 where the whole picture just fits. x, y: what is in the middle, as parts of the picture's width and height.
  function view() {
    const { posX, posY, scale } = shell.imageContainer.current.state;
    return {
      zoom: scale / fit(),
      x: (frame().clientWidth / 2 - posX) / (size.width * scale),
      y: (frame().clientHeight / 2 - posY) / (size.height * scale),
    };
  }

  // Returns the view that it comes to.
  function look({ zoom, x, y }) {
    const asked = { zoom, x, y };
    last = coming = asked;
    const scale = Math.min(Math.max(zoom, 0.2) * fit(), LARGEST);
    // Whole pixels of the screen, so that the picture's rim is sharp.
    const [posX, posY] = [frame().clientWidth / 2 - x * size.width * scale, frame().clientHeight / 2 - y * size.height * scale].map(Math.round);
    shell.imageContainer.current.setState({ posX, posY, scale }, () => {
      if (coming === asked) coming = null;
      tell();
    });
    shell.tools.current?.onZoom(scale * devicePixelRatio);
    return { zoom: scale / fit(), x, y };
  }

  // Zoom by a factor about a point of the picture (parts of its size), which stays where it is.
  function zoom(factor, about = null) {
    const now = view();
    const next = Math.min(Math.max(now.zoom * factor, 0.2), LARGEST / fit());
    const towards = (c, p) => p + (c - p) * (now.zoom / next);
    look({ zoom: next, x: towards(now.x, about?.x ?? now.x), y: towards(now.y, about?.y ?? now.y) });
  }

  // Where a point of the screen lies in the picture, in pixels; the middle of the first is ½.
  function pixelAt(clientX, clientY) {
    const { posX, posY, scale } = shell.imageContainer.current.state;
    const box = frame().getBoundingClientRect();
    return { x: (clientX - box.left - posX) / scale, y: (clientY - box.top - posY) / scale };
  }

  // FlipBook's tone mapping of a picture; only what changes is drawn anew.
  function paint(index, settings) {
    const controls = shell.tmoCtrls.current;
    const now = { ...controls.state.soloSettings[index], ...settings };
    if (JSON.stringify(now) === JSON.stringify(controls.state.soloSettings[index]) && controls.state.soloMode[index]) return;
    controls.state.soloSettings[index] = now;
    controls.state.soloMode[index] = true;
    controls.applySingle(controls.props.toneMappers[index], now);
    controls.forceUpdate();
  }

  return {
    open, canvases, frame, view, look, zoom, pixelAt, paint,
    get size() { return size; },
    get scale() { return shell.imageContainer.current.state.scale; },
    get place() { const { posX, posY } = shell.imageContainer.current.state; return { x: posX, y: posY }; },
    get selected() { return shell.state.selectedIdx; },
    select: (index) => flipbook.UpdateFlipGroupSelection(host.id, index),
    on: (call) => listeners.push(call),
  };
})();
