// Exposure and false colour of all pictures in step, and the scale of the one that is shown.
"use strict";

const exposure = (() => {
  const field = document.getElementById("ev");
  const colours = document.getElementById("colours");
  const legend = document.querySelector(".viewer-scale");
  const strips = [...document.querySelectorAll(".strip .scale")];
  const mapped = JSON.parse(document.getElementById("false-colour").textContent); // {glsl, css, ticks: [[EV above white, %]]}
  let pictures = [];
  let usual = 0; // EV of the image as the report shows it

  const radiance = (picture) => picture.tmo.activeTMO === "exposure";
  // Differences of radiance: their scales narrow as the exposure goes up.
  const signed = (picture) => picture.key === "error" || picture.key.startsWith("rung-");
  const ev = () => (view.get("ev") !== "" && Number.isFinite(Number(view.get("ev"))) ? Number(view.get("ev")) : usual);
  const gain = () => 2 ** (ev() - usual);

  function settings(picture) {
    if (radiance(picture)) {
      if (view.get("colours") !== "false") return { activeTMO: "exposure", exposure: ev() };
      const luminance = `dot(rgb, vec3(0.2126, 0.7152, 0.0722)) * float(${2 ** ev()})`;
      return { activeTMO: "script", script: `if (!anynan(rgb)) rgb = vec3(log2(max(${luminance}, 1e-30)));\n${mapped.glsl}` };
    }
    return signed(picture) ? { script: `rgb *= float(${gain()});\n${picture.tmo.script}` } : {};
  }

  function draw() {
    pictures.forEach((picture, i) => book.paint(i, settings(picture)));
    field.value = Number(ev().toFixed(2));
    colours.checked = view.get("colours") === "false";
    label();
  }

  // The strip's scale of the picture that is shown, with what its ends stand for now.
  function label() {
    const picture = pictures[book.selected];
    const copy = strips[book.selected].cloneNode(true);
    const [bar, ticks, caption] = [".bar", ".ticks", "p"].map((name) => copy.querySelector(name));
    const put = (marks) => ticks.replaceChildren(...marks.map(([at, text]) => {
      const mark = document.createElement("span");
      mark.style.left = `${at}%`;
      mark.textContent = text;
      return mark;
    }));
    const words = `exposure ${digits.signed(Number(ev().toFixed(2)), 3)} EV`;
    if (radiance(picture) && view.get("colours") === "false") {
      bar.style.background = mapped.css;
      put(mapped.ticks.map(([stops, at]) => [at, digits.short(2 ** (stops - ev()))]));
      caption.textContent = `luminance, logarithmic; ${words}`;
    } else if (radiance(picture)) {
      put([[0, "0"], [50, digits.short(((0.5 + 0.055) / 1.055) ** 2.4 / 2 ** ev())], [100, `≥ ${digits.short(2 ** -ev())}`]]);
      caption.textContent = `radiance; ${words}, sRGB`;
    } else if (signed(picture)) {
      const end = picture.tmo.max / gain();
      put([[0, `−${digits.short(end)}`], [50, "0"], [100, `+${digits.short(end)}`]]);
    }
    copy.setAttribute("aria-label", `Colour scale: ${caption.textContent}, from ${ticks.firstElementChild.textContent} to ${ticks.lastElementChild.textContent}`);
    legend.replaceChildren(copy);
    document.querySelector(".tools .shown").textContent = picture.name;
  }

  const set = (value) => { if (Number.isFinite(value)) view.set({ ev: Math.abs(value - usual) < 1e-3 ? "" : String(Number(value.toFixed(3))) }); };
  field.addEventListener("change", () => (field.value === "" ? view.set({ ev: "" }) : set(Number(field.value))));
  colours.addEventListener("change", () => view.set({ colours: colours.checked ? "false" : "" }));
  view.on(["ev", "colours"], draw);

  return {
    start(all) {
      pictures = all;
      usual = all.find(radiance)?.tmo.exposure ?? 0;
      book.on(label);
      draw();
    },
    step: (stops) => set(ev() + stops),
    toggle: () => view.set({ colours: view.get("colours") ? "" : "false" }),
  };
})();
