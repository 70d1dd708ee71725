// A cell's pictures as floats: read from the scripts that the cell names, unpacked, and derived from one another.
"use strict";

const pixels = (() => {
  const waiting = new Map(); // name of a piece of data → function that takes it

  // A file of data calls `receive`. In a page of a single file it stands as text in the page.
  function fetch(name, file) {
    return new Promise((resolve, reject) => {
      waiting.set(name, resolve);
      const script = document.createElement("script");
      const inline = document.querySelector(`script[data-file="${CSS.escape(file)}"]`);
      script.onerror = () => reject(new Error(`${file} does not load`));
      script.onload = () => script.remove();
      if (inline) script.textContent = inline.textContent;
      else script.src = file.split("/").map(encodeURIComponent).join("/");
      document.head.append(script);
    });
  }

  async function inflate(base64) {
    const packed = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  // The inverse of report/packing.py: Float32Array of width × height × channels.
  async function unpack(packed, width, height) {
    const { channels, planes, step, soft, nan } = packed;
    const bytes = await inflate(packed.data);
    const size = width * height;
    const codes = new Int32Array(size * channels);
    for (let k = 0; k < planes; k++) for (let i = 0, at = k * codes.length; i < codes.length; i++) codes[i] |= bytes[at + i] << (8 * k);
    for (let first = 0; first < codes.length; first += size) {
      for (let y = 0, i = first; y < height; y++) {
        for (let x = 0; x < width; x++, i++) {
          let predicted = 0;
          if (x && y) {
            const left = codes[i - 1], above = codes[i - width], corner = codes[i - width - 1];
            const low = Math.min(left, above), high = Math.max(left, above);
            predicted = corner >= high ? low : corner <= low ? high : left + above - corner;
          } else if (x) predicted = codes[i - 1];
          else if (y) predicted = codes[i - width];
          codes[i] = ((codes[i] >>> 1) ^ -(codes[i] & 1)) + predicted;
        }
      }
    }
    const value = (code) => (code === nan ? NaN : soft ? soft * Math.sinh(code * step) : code * step);
    const out = new Float32Array(size * channels);
    if (channels === 1) for (let i = 0; i < size; i++) out[i] = value(codes[i]);
    else {
      for (let i = 0; i < size; i++) {
        const green = codes[i];
        out[3 * i] = value(codes[size + i] + green);
        out[3 * i + 1] = value(green);
        out[3 * i + 2] = value(codes[2 * size + i] + green);
      }
    }
    return out;
  }

  // As compare/error_map.py has them; the rounding of what is kept is no finding, so it counts as noise.
  const derived = {
    error: ({ image, reference }) => image.map((value, i) => value - reference[i]),
    relative: ({ image, reference }, { epsilon }) => image.map((value, i) => {
      const below = Math.max(reference[i], 0) + epsilon;
      return below > 0 ? (value - reference[i]) / below : Math.sign(value - reference[i]);
    }),
    zscore: ({ image, reference, sigma, own_sigma }, { width, height, rounding: [step, soft], largest_z }) => Float32Array.from({ length: width * height }, (_, i) => {
      let error = 0, size = 0, noise = 0;
      for (let c = 3 * i; c < 3 * i + 3; c++) {
        error += Math.abs(image[c] - reference[c]) / 3;
        size += Math.abs(reference[c]) / 3;
        noise += Math.hypot(sigma[c], own_sigma?.[c] ?? 0) / 3;
      }
      return Math.min(error / Math.hypot(noise, step * (size + soft) / 2), largest_z);
    }),
    // As `first` of compare/regions.py, by what stands in `where`: 1 on the object, 2ᵏ in region k, 2¹⁰ on the outline.
    regions: ({ where }) => where.map((places) => (places & 1024 ? 10 : places > 1 ? Math.log2((places & ~1) & -(places & ~1)) : 0)),
  };

  // Of a cell's section: { width, height, epsilon, rounding, known, pictures: [{ key, name, tmo, channels, values }] }. known: image,
  // reference, their standard errors own_sigma and sigma, where (as above), each Float32Array or missing.
  async function load(section) {
    const [file, ...shared] = section.dataset.files.split(" ");
    const [cell, ...rest] = await Promise.all([fetch(section.id, file), ...shared.map((one) => fetch(one, one))]);
    const packed = Object.assign({}, ...rest.map((one) => one.packed), cell.packed);
    const known = {};
    for (const key of Object.keys(packed)) known[key] = await unpack(packed[key], cell.width, cell.height);
    const pictures = cell.pictures.map((picture) => {
      known[picture.key] ??= derived[picture.key](known, cell);
      return { ...picture, channels: known[picture.key].length / (cell.width * cell.height), values: known[picture.key] };
    });
    return { width: cell.width, height: cell.height, epsilon: cell.epsilon, rounding: cell.rounding, known, pictures };
  }

  return { load, receive: (name, data) => { waiting.get(name)?.(data); waiting.delete(name); } };
})();
