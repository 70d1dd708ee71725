"""A cell's pictures for the page: PNG previews, colour scales, and half-float data for FlipBook."""

from __future__ import annotations

import base64
import hashlib
import json
import re
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.image import exr, ldr
from evalsuite.image.color import luminance, tone_map
from evalsuite.image.files import replacing
from evalsuite.report import scales
from evalsuite.report.scales import Scale

#: Changes when what is written changes, so that pages of an older version are made anew.
VERSION = 2
#: name in cell["images"] → (title, what it shows)
TITLES = {
    "image": ("Image", "what the GPU draws"),
    "reference": ("Reference", "what Mitsuba integrates"),
    "error": ("Signed difference", "image − reference; blue: image too dark, red: too bright"),
    "relative": ("Relative difference", "(image − reference) / reference; blue: too dark, red: too bright"),
    "zscore": ("Certainty", "|error| in standard errors of the reference; grey: noise decides"),
    "flip": ("FLIP", "difference as a viewer perceives it when flipping between the two"),
}


_RUNG = re.compile(r"rung-(\d+)")


def titles(cell: Mapping) -> dict[str, tuple[str, str]]:
    """name → (title, what it shows) of all pictures that a cell can have."""
    of_rungs = {
        f"rung-{k}": (rung["rung"].capitalize(), f"{rung['to']} − {rung['from']}; blue: darker, red: brighter")
        for k, rung in enumerate(cell.get("ledger") or [])
    }
    of_regions = {"regions": ("Regions", "where on the object; a pixel of several has the first one's colour")}
    return {**TITLES, **of_rungs, **(of_regions if "regions" in cell.get("images", {}) else {})}


@dataclass(frozen=True)
class Picture:
    """name: key in cell["images"]. preview: PNG path relative to the page."""

    name: str
    title: str
    shows: str
    preview: str
    width: int
    height: int
    scale: Scale


def prepare(cell: Mapping, slug: str, directory: Path) -> tuple[list[Picture], list[str]]:
    """Write `cells/<slug>.js` and the previews unless they are there for these very files; (pictures, problems)."""
    named = titles(cell)
    paths = {name: directory / cell["images"][name] for name in (*named, "mask") if cell.get("images", {}).get(name)}
    if not paths:
        return [], []
    script = directory / "cells" / f"{slug}.js"
    key = _key(cell, paths)
    done = _sidecar(script.with_suffix(".json"), key)
    if done is None:
        done = {"key": key, **_make(cell, paths, script)}
        with replacing(script.with_suffix(".json")) as temporary:
            temporary.write_text(json.dumps(done), encoding="utf-8")
    pictures = []
    for entry in done["pictures"]:
        scale = Scale(*(_tuples(entry["scale"][field]) for field in ("stops", "ticks")), entry["scale"]["caption"])
        title, shows = named[entry["name"]]
        preview = f"cells/{slug}/{entry['name']}.png"
        pictures.append(Picture(entry["name"], title, shows, preview, entry["width"], entry["height"], scale))
    return pictures, done["problems"]


def _make(cell: Mapping, paths: Mapping[str, Path], script: Path) -> dict:
    arrays, problems, named = {}, [], titles(cell)
    for name, path in paths.items():
        if name == "mask":
            continue
        try:
            arrays[name] = next(iter(exr.read_parts(path).values()))
        except EvalsuiteError as error:
            problems.append(f"{named[name][0]} cannot be shown: {error}")
    shapes = {array.shape[:2] for array in arrays.values()}
    if len(shapes) > 1:
        arrays = {}
        problems.append(f"pictures of different sizes cannot be shown: {', '.join(map(str, sorted(shapes)))}")
    pictures, items = [], []
    mask = _mask(paths.get("mask"), shapes)
    for name, array in arrays.items():
        scale, encoded, settings = _look(name, array, cell, arrays, mask)
        ldr.write_png(script.with_suffix("") / f"{name}.png", encoded)
        height, width = array.shape[:2]
        stops = {"stops": scale.stops, "ticks": scale.ticks, "caption": scale.caption}
        pictures.append({"name": name, "width": width, "height": height, "scale": stops})
        items.append({"name": named[name][0], "tmo": settings, "channels": array.size // (width * height), "data": _half(array)})
    if items:
        content = {"width": width, "height": height, "pictures": items}
        with replacing(script) as temporary:
            temporary.write_text(f"evalsuite.receive({js_json(script.stem)}, {js_json(content)});\n", encoding="utf-8")
    return {"pictures": pictures, "problems": problems}


def _look(
    name: str, array: NDArray, cell: Mapping, arrays: Mapping[str, NDArray], mask: NDArray[np.bool_] | None
) -> tuple[Scale, NDArray, dict]:
    """(scale, preview in sRGB, FlipBook's tone-map settings) of a picture."""
    finite = np.nan_to_num(array, nan=0.0, posinf=65504.0, neginf=-65504.0)
    if name in ("image", "reference"):
        exposure = float(cell.get("exposure") or _exposure(arrays.get("reference", array)))
        settings = {"activeTMO": "exposure", "exposure": round(float(np.log2(exposure)), 3), "min": 0, "max": 1 / exposure}
        rgb = finite if finite.ndim == 3 else np.repeat(finite[..., None], 3, axis=2)
        return scales.radiance(exposure), tone_map(rgb, exposure), settings
    values = finite.mean(axis=2) if finite.ndim == 3 else finite
    scored = values if mask is None else values[mask]
    if name == "error":
        scale = scales.diverging(scales.nice_limit(scored, 0.0), "image − reference, radiance")
    elif _RUNG.fullmatch(name):
        # One scale for all rungs, so that they can be told apart by their colours.
        rungs = [a.mean(axis=2) if a.ndim == 3 else a for n, a in arrays.items() if _RUNG.fullmatch(n)]
        all_values = np.concatenate([np.nan_to_num(r if mask is None else r[mask]).ravel() for r in rungs])
        ends = cell["ledger"][int(name.removeprefix("rung-"))]
        scale = scales.diverging(scales.nice_limit(all_values, 0.0), f"{ends['to']} − {ends['from']}, radiance")
    elif name == "relative":
        limit = min(max(scales.nice_limit(scored, 0.01), 0.01), 1.0)
        scale = scales.diverging(limit, "(image − reference) / reference", percent=True)
    elif name == "regions":
        scale = scales.regions(cell.get("regions") or ())
    else:
        scale = scales.standard_errors() if name == "zscore" else scales.flip()
    settings = {"activeTMO": "script", "script": scale.glsl, "exposure": 0, "min": scale.low, "max": scale.high}
    return scale, scale.colours(values), settings


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


def _half(array: NDArray) -> str:
    """Half floats, little-endian, all low bytes before all high bytes (compresses better), deflated, base64. Beyond half's
    range values are cut at ±65504; the sign is kept."""
    halves = np.clip(array, -65504, 65504).astype("<f2")
    planes = np.frombuffer(halves.tobytes(), np.uint8).reshape(-1, 2).T
    return base64.b64encode(zlib.compress(planes.tobytes(), 4)).decode("ascii")


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


def _sidecar(path: Path, key: str) -> dict | None:
    """What an earlier run wrote for these files, if its script and previews are still there."""
    try:
        done = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    pictures = done.get("pictures", [])
    files = [path.with_suffix("") / f"{p['name']}.png" for p in pictures] + [path.with_suffix(".js")] * bool(pictures)
    return done if done.get("key") == key and all(file.exists() for file in files) else None


def _tuples(value: object) -> object:
    return tuple(_tuples(v) for v in value) if isinstance(value, list) else value
