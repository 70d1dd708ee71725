"""A cell's pictures for the page: previews, colour scales, and the data that `static/pixels.js` reads."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare import error_map, regions
from evalsuite.errors import EvalsuiteError
from evalsuite.image import exr, ldr
from evalsuite.image.color import luminance, tone_map
from evalsuite.image.files import replacing
from evalsuite.report import packing, scales
from evalsuite.report.scales import Scale

#: Changes when what is written changes, so that pages of an older version are made anew.
VERSION = 4
#: name in cell["images"] → (title, what it shows)
TITLES = {
    "image": ("Image", "what the GPU draws"),
    "reference": ("Reference", "what Mitsuba integrates"),
    "error": ("Signed difference", "image − reference; blue: image too dark, red: too bright"),
    "relative": ("Relative difference", "(image − reference) / reference; blue: too dark, red: too bright"),
    "zscore": ("Certainty", "|error| in standard errors of the reference; grey: noise decides"),
    "flip": ("FLIP", "difference as a viewer perceives it when flipping between the two"),
}
#: Standard errors, which are not shown as pictures; and what follows from the others.
NOISE = ("standard_error", "image_standard_error")
DERIVED = ("relative", "zscore")
#: Largest side of a preview [pixels].
PREVIEW = 192
#: Steps of the page's data from 0 to the end of the scale; 64 for rungs.
STEPS = {"error": 256, "flip": 256}
_RUNG = re.compile(r"rung-(\d+)")


def titles(cell: Mapping) -> dict[str, tuple[str, str]]:
    """name → (title, what it shows) of all pictures that a cell can have."""
    of_rungs = {
        f"rung-{k}": (rung["rung"].capitalize(), f"{rung['to']} − {rung['from']}; blue: darker, red: brighter")
        for k, rung in enumerate(cell.get("ledger") or [])
    }
    of_targets = {
        f"target-{name}": (f"Truth: {name}", f"what Mitsuba integrates as {name}, a truth of the ledger")
        for name in cell.get("truths") or {}
    }
    of_samples = (
        {"spp": ("Samples", "that the reference has of each pixel, logarithmic")} if "spp" in cell.get("images", {}) else {}
    )
    of_regions = {"regions": ("Regions", "where on the object; a pixel of several has the first one's colour")}
    first = {name: TITLES[name] for name in ("image", "reference")}
    return {
        **first,
        **of_targets,
        **TITLES,
        **of_rungs,
        **of_samples,
        **(of_regions if "regions" in cell.get("images", {}) else {}),
    }


@dataclass(frozen=True)
class Picture:
    """name: key in cell["images"], or of what follows from them. preview: path relative to index.html."""

    name: str
    title: str
    shows: str
    preview: str
    width: int
    height: int
    scale: Scale


@dataclass(frozen=True)
class Prepared:
    """A cell's pictures in the page's order. problems: what cannot be shown, in words. files: the data that the cell's page
    reads, relative to `cells/`."""

    pictures: tuple[Picture, ...] = ()
    problems: tuple[str, ...] = ()
    files: tuple[str, ...] = ()


def prepare(cell: Mapping, slug: str, directory: Path) -> Prepared:
    """Write the cell's data and previews into `cells/`, unless they are there for these very files."""
    paths = {
        name: directory / cell["images"][name] for name in (*titles(cell), *NOISE, "mask") if cell.get("images", {}).get(name)
    }
    outside = [name for name, path in paths.items() if not path.resolve().is_relative_to(directory.resolve())]
    if outside:
        return Prepared(problems=(f"pictures outside the report's folder cannot be shown: {', '.join(outside)}",))
    if not paths:
        return Prepared()
    sidecar = directory / "cells" / f"{slug}.json"
    key = _key(cell, paths)
    done = _read_sidecar(sidecar, key)
    if done is None:
        done = {"key": key, **_make(cell, paths, directory / "cells", slug)}
        with replacing(sidecar) as temporary:
            temporary.write_text(json.dumps(done), encoding="utf-8")
    pictures, named = [], titles(cell)
    for entry in done["pictures"]:
        scale = Scale(*(_tuples(entry["scale"][field]) for field in ("stops", "ticks")), entry["scale"]["caption"])
        preview = f"cells/{slug}/{entry['name']}.webp"
        pictures.append(Picture(entry["name"], *named[entry["name"]], preview, entry["width"], entry["height"], scale))
    return Prepared(tuple(pictures), tuple(done["problems"]), tuple(done["files"]))


def _make(cell: Mapping, paths: Mapping[str, Path], folder: Path, slug: str) -> dict:
    arrays, problems, named = {}, [], titles(cell)
    for name, path in paths.items():
        if name in DERIVED or name == "mask":
            continue
        try:
            arrays[name] = next(iter(exr.read_parts(path).values()))
            if name == "spp":
                arrays[name] = np.log2(np.maximum(arrays[name], 1.0))
        except EvalsuiteError as error:
            problems.append(f"{named[name][0] if name in named else name} cannot be shown: {error}")
    shapes = {array.shape[:2] for array in arrays.values()}
    if len(shapes) > 1:
        arrays = {}
        problems.append(f"pictures of different sizes cannot be shown: {', '.join(map(str, sorted(shapes)))}")
    mask = _mask(paths.get("mask"), shapes)
    data = Data(arrays, mask)
    shown = {name: data.shown[name] for name in named if name in data.shown}
    if not shown:
        return {"pictures": [], "problems": problems, "files": []}
    pictures, items = [], []
    shared = [data.reference_packed] if data.reference_packed else []
    (height, width), packed = shapes.pop(), data.packed()
    for name, array in shown.items():
        scale, encoded, settings = _look(name, array, cell, shown, mask)
        ldr.write_webp(folder / slug / f"{name}.webp", encoded)
        stops = {"stops": scale.stops, "ticks": scale.ticks, "caption": scale.caption}
        pictures.append({"name": name, "width": width, "height": height, "scale": stops})
        items.append({"key": name, "name": named[name][0], "tmo": settings})
        if name.startswith("target-"):
            shared.append({name: packing.pack(array, data.step, data.soft)})
        elif not (name == "reference" or name in packed) and name not in data.derivable:
            packed[name] = packing.pack(_mean(array), scale.high / STEPS.get(name, 64))
    files = [f"{slug}.js"]
    for one in shared:
        file = f"references/{hashlib.sha256(json.dumps(one).encode()).hexdigest()[:16]}.js"
        files.append(file)
        _receive(folder / file, file, {"packed": one})
    content = {"width": width, "height": height, "pictures": items, "packed": packed, **data.constants}
    _receive(folder / files[0], slug, content)
    return {"pictures": pictures, "problems": problems, "files": files}


def _receive(path: Path, name: str, content: Mapping) -> None:
    text = f"pixels.receive({js_json(name)}, {js_json(content)});\n"
    if not (path.is_file() and path.read_text(encoding="utf-8") == text):
        with replacing(path) as temporary:
            temporary.write_text(text, encoding="utf-8")


def _look(
    name: str, array: NDArray, cell: Mapping, arrays: Mapping[str, NDArray], mask: NDArray[np.bool_] | None
) -> tuple[Scale, NDArray, dict]:
    """(scale, preview in sRGB, FlipBook's tone-map settings) of a picture."""
    finite = np.nan_to_num(array, nan=0.0, posinf=65504.0, neginf=-65504.0)
    if name in ("image", "reference") or name.startswith("target-"):
        exposure = float(cell.get("exposure") or _exposure(arrays.get("reference", array)))
        settings = {"activeTMO": "exposure", "exposure": round(float(np.log2(exposure)), 3), "min": 0, "max": 1 / exposure}
        rgb = finite if finite.ndim == 3 else np.repeat(finite[..., None], 3, axis=2)
        return scales.radiance(exposure), tone_map(_reduced(rgb), exposure), settings
    values = _mean(finite)
    scored = values if mask is None else values[mask]
    if name == "error":
        scale = scales.diverging(scales.nice_limit(scored, 0.0), "image − reference, radiance")
    elif _RUNG.fullmatch(name):
        # One scale for all rungs, so that they can be told apart by their colours.
        rungs = [_mean(a) for n, a in arrays.items() if _RUNG.fullmatch(n)]
        all_values = np.concatenate([np.nan_to_num(r if mask is None else r[mask]).ravel() for r in rungs])
        ends = cell["ledger"][int(name.removeprefix("rung-"))]
        scale = scales.diverging(scales.nice_limit(all_values, 0.0), f"{ends['to']} − {ends['from']}, radiance")
    elif name == "relative":
        limit = min(max(scales.nice_limit(scored, 0.01), 0.01), 1.0)
        scale = scales.diverging(limit, "(image − reference) / reference", percent=True)
    elif name == "regions":
        scale = scales.regions(cell.get("regions") or ())
        values = values[:: _factor(values), :: _factor(values)]  # numbers have no mean
    elif name == "spp":
        scale = scales.samples(values)
    else:
        scale = scales.standard_errors() if name == "zscore" else scales.flip()
    settings = {"activeTMO": "script", "script": scale.glsl, "exposure": 0, "min": scale.low, "max": scale.high}
    return scale, scale.colours(values if name == "regions" else _reduced(values)), settings


def _factor(array: NDArray) -> int:
    return -(-max(array.shape[:2]) // PREVIEW)


def _reduced(array: NDArray) -> NDArray:
    """Means of square blocks, as few pixels each as let the preview be no larger than PREVIEW."""
    k = _factor(array)
    rest = [(0, -size % k) for size in array.shape[:2]] + [(0, 0)] * (array.ndim - 2)
    padded = np.pad(array, rest, mode="edge")
    height, width = (size // k for size in padded.shape[:2])
    return padded.reshape(height, k, width, k, *array.shape[2:]).mean(axis=(1, 3))


def _mean(array: NDArray) -> NDArray:
    return array.mean(axis=2) if array.ndim == 3 else array


class Data:
    """A cell's pictures: what is shown, what the page derives by itself, and what it must be given."""

    def __init__(self, arrays: Mapping[str, NDArray], mask: NDArray[np.bool_] | None) -> None:
        self.shown = {name: array for name, array in arrays.items() if name not in NOISE}
        self._own = arrays.get("image_standard_error")
        image, reference = arrays.get("image"), arrays.get("reference")
        self._pair = (image, reference) if image is not None and reference is not None else None
        sigma = arrays.get("standard_error")
        self.step, self.soft = packing.fineness(reference, sigma, mask) if reference is not None else (packing.FINEST, 1.0)
        self._sigma = sigma
        self._noise = np.hypot(sigma, self._own) if sigma is not None and self._own is not None else sigma
        self._noise = None if self._noise is None else _mean(self._noise)
        self.derivable, self.constants = set(), {"rounding": [self.step, self.soft], "largest_z": error_map.MAX_Z, "epsilon": 0.0}
        self._where = self._places(mask)
        if self._where is not None:
            self.derivable.add("regions")
        if self._pair and all(a.ndim == 3 for a in self._pair) and "error" in arrays:
            scale = float(np.nanmean(reference if mask is None else reference[mask]))
            self.constants["epsilon"] = error_map.EPSILON * scale
            self.derivable |= {"error", "relative"}
            self.shown["relative"] = error_map.relative(image, reference, scale)
            if self._noise is not None:
                self.derivable.add("zscore")
                self.shown["zscore"] = self._zscore(image, reference)

    def _zscore(self, image: NDArray, reference: NDArray) -> NDArray:
        """As `error_map.z_score`, the rounding of what is kept counting as noise."""
        rounding = self.step * (np.abs(reference).mean(axis=2) + self.soft) / 2
        error = np.abs(image - reference).mean(axis=2)
        return np.minimum(error / np.hypot(self._noise, rounding), error_map.MAX_Z)

    def _places(self, mask: NDArray[np.bool_] | None) -> NDArray | None:
        """(H, W): 1 on the object, and twice the set of regions (`compare.regions.picture`), which are shown by their first."""
        sets = self.shown.get("regions")
        if sets is not None:
            self.shown["regions"] = regions.first(sets)
        parts = [part for part in (mask, None if sets is None else 2 * sets) if part is not None]
        return sum(part.astype(np.float64) for part in parts) if parts else None

    @property
    def reference_packed(self) -> dict:
        """What cells of one reference share."""
        if "reference" not in self.shown:
            return {}
        found = {"reference": packing.pack(self.shown["reference"], self.step, self.soft)}
        return found | ({} if self._sigma is None else {"sigma": _pack_sigma(self._sigma)})

    def packed(self) -> dict:
        """What is the cell's own, but for differences whose scale decides their steps."""
        found = {"image": packing.pack(self.shown["image"], self.step, self.soft)} if "image" in self.shown else {}
        found |= {} if self._own is None else {"own_sigma": _pack_sigma(self._own)}
        return found | ({} if self._where is None else {"where": packing.pack(self._where, 1.0)})


def _pack_sigma(sigma: NDArray) -> dict:
    return packing.pack(sigma, 1 / 32, 1e-3 * float(np.nanmean(sigma)) or 1.0)


def _mask(path: Path | None, shapes: set[tuple[int, int]]) -> NDArray[np.bool_] | None:
    """The scored pixels, which decide the ends of the scales; None where there is no usable mask."""
    try:
        mask = exr.read(path)[..., 0] > 0.5 if path else None
    except EvalsuiteError:
        return None
    return mask if mask is not None and mask.any() and {mask.shape} == shapes else None


def _exposure(reference: NDArray) -> float:
    y = luminance(reference) if reference.ndim == 3 else reference
    white = float(np.nanpercentile(np.where(np.isfinite(y), y, 0.0), 99))
    return 1.0 / white if white > 0 else 1.0


def js_json(value: object) -> str:
    """JSON that may stand inside a <script>: no character that could end the script or the line."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text


def _key(cell: Mapping, paths: Mapping[str, Path]) -> str:
    rungs = [[rung[name] for name in ("rung", "from", "to")] for rung in cell.get("ledger") or []]
    digest = hashlib.sha256(json.dumps([VERSION, cell.get("exposure"), rungs]).encode())
    for name, path in paths.items():
        digest.update(name.encode())
        if path.is_file():
            digest.update(path.read_bytes())
    return digest.hexdigest()


def _read_sidecar(path: Path, key: str) -> dict | None:
    """What an earlier run wrote for these files, if its data and previews are still there."""
    try:
        done = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if done.get("key") != key:
        return None
    files = [path.with_suffix("") / f"{p['name']}.webp" for p in done["pictures"]] + [path.parent / f for f in done["files"]]
    return done if all(file.exists() for file in files) else None


def _tuples(value: object) -> object:
    return tuple(_tuples(v) for v in value) if isinstance(value, list) else value
