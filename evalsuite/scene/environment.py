"""Reads lat-long maps, cleans them openly, and looks them up as Mitsuba does.

Every way a file can be bad ends in one EvalsuiteError that names it; whatever was changed is said in `Environment.notes`.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.image import radiance_hdr
from evalsuite.image.environment_maps import LAYOUT
from evalsuite.image.exr import check_claim
from evalsuite.image.files import read_bytes
from evalsuite.math.sphere import latlong_lookup
from evalsuite.scene.model import Environment

MAX_TEXELS = 2**27  # 16384 × 8192; more than 1.6 GB as float32 RGB is a damaged header rather than a map
WANTED = "a lat-long .exr or .hdr picture"


def read_environment(path: str | Path, repair: bool = False) -> Environment:
    """Lat-long map from an OpenEXR or Radiance file, with to_world = identity.

    repair: replace NaN and −Inf by 0 and +Inf by the channel's largest finite value, and say so in the notes. Negative
    texels are always clamped to 0, with a note: Mitsuba would light surfaces with them but never sample them. Maps smaller
    than 2×3 texels are repeated as Mitsuba repeats them, so that both renderers see one function.
    Raises EvalsuiteError for anything else that keeps the file from being a finite map.
    """
    path = Path(path)
    read = {".exr": _read_exr, ".hdr": _read_hdr}.get(path.suffix.lower())
    if path.is_dir():
        raise EvalsuiteError(path, "a folder", WANTED)
    if not path.exists():
        raise EvalsuiteError(path, "no such file", WANTED, "check the path")
    if read is None:
        raise EvalsuiteError(path, f"the extension '{path.suffix}'", WANTED, "convert it first")
    try:
        path.open("rb").close()
    except OSError as error:
        raise EvalsuiteError(path, f"{error.strerror}", "a readable file", "check its permissions") from error
    return clean_environment(read(path), str(path), repair)


def clean_environment(radiance: ArrayLike, source: str, repair: bool = False) -> Environment:
    """Environment of (H, W, 3) texels after the checks and repairs of `read_environment`; raises EvalsuiteError likewise."""
    texels = np.array(radiance, dtype=np.float32)
    notes, remarks = [], []
    if texels.ndim != 3 or texels.shape[2] != 3 or texels.size == 0:
        raise EvalsuiteError(source, f"an array of shape {texels.shape}", "(height, width, 3) texels")
    bad = ~np.isfinite(texels)
    if bad.any():
        count = int(bad.any(axis=2).sum())
        row, column, channel = (int(i) for i in np.argwhere(bad)[0])
        what = f"{_texels(count)} with NaN or Inf, the first in row {row}, column {column} ({texels[row, column, channel]})"
        if not repair:
            raise EvalsuiteError(source, what, "finite radiance", "mend the map, or give --repair-env")
        ceiling = np.where(bad, 0.0, texels).max(axis=(0, 1))
        texels = np.where(bad, np.where(texels == np.inf, ceiling, 0.0), texels).astype(np.float32)
        notes.append(f"{what}; NaN and -Inf replaced by 0, +Inf by the channel's largest finite value")
    negative = texels < 0.0
    if negative.any():
        count = int(negative.any(axis=2).sum())
        notes.append(f"{_texels(count)} with negative radiance (down to {texels.min():.4g}) clamped to 0")
        texels = np.maximum(texels, 0.0)
    height, width = texels.shape[:2]
    texels = _as_mitsuba_keeps(texels)
    if texels.shape[:2] != (height, width):
        remarks.append(f"{width}×{height} map repeated to {texels.shape[1]}×{texels.shape[0]} texels, as Mitsuba does")
    texels = np.ascontiguousarray(texels) + np.float32(0.0)  # −0 → 0
    return Environment(texels, np.eye(3), source, tuple(notes), tuple(remarks))


def scaled(environment: Environment, scale: float) -> Environment:
    """The environment with radiance times scale ≥ 0."""
    return replace(environment, radiance=(environment.radiance * np.float32(scale)).astype(np.float32))


def evaluate(environment: Environment, directions: ArrayLike) -> NDArray[np.float64]:
    """Radiance [W m⁻² sr⁻¹], (..., 3) float64, arriving from world directions (..., 3); twin of Mitsuba's `envmap`."""
    local = np.asarray(directions, np.float64) @ environment.to_world  # row vectors: d @ R = Rᵀ d
    return latlong_lookup(environment.radiance, local)


def _texels(count: int) -> str:
    return f"{count} texel" + ("s" if count != 1 else "")


def _as_mitsuba_keeps(texels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Mitsuba pads maps below 2 columns or 3 rows by repeating the last; a 1×1 map stays, as it becomes `constant`."""
    height, width = texels.shape[:2]
    if (height, width) == (1, 1):
        return texels
    return np.pad(texels, ((0, max(3 - height, 0)), (0, max(2 - width, 0)), (0, 0)), mode="edge")


def _check_size(path: Path, width: int, height: int) -> None:
    if width < 1 or height < 1 or width * height > MAX_TEXELS:
        raise EvalsuiteError(path, f"a header that says {width}×{height}", f"1 to {MAX_TEXELS} texels", "the file is damaged")


def _read_exr(path: Path) -> NDArray[np.float32]:
    import OpenEXR

    damaged = "a complete OpenEXR picture"
    try:
        with _silence():
            with OpenEXR.File(str(path), separate_channels=True, header_only=True) as file:
                header = file.parts[0].header
                (x0, y0), (x1, y1) = (tuple(int(i) for i in corner) for corner in header["dataWindow"])
                _check_size(path, x1 - x0 + 1, y1 - y0 + 1)
                check_claim(path, header)
                kind = str(header.get("type", ""))
                layout = header.get(LAYOUT, "latlong")
                if layout != "latlong":
                    fix = f"`evalsuite env convert {path} -o latlong.exr --to latlong`"
                    raise EvalsuiteError(path, f"a {layout} map", WANTED, fix)
                if "deep" in kind.lower():
                    raise EvalsuiteError(path, "a deep OpenEXR picture", WANTED, "flatten it first")
            with OpenEXR.File(str(path), separate_channels=True) as file:
                if not file.parts:
                    raise EvalsuiteError(path, "pixels that cannot be read", damaged, "the file is truncated or damaged")
                channels = {name: np.array(channel.pixels) for name, channel in file.parts[0].channels.items()}
    except EvalsuiteError:
        raise
    except Exception as error:  # the binding raises RuntimeError, ValueError, KeyError, MemoryError, depending on the damage
        first_line = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise EvalsuiteError(path, f"'{first_line}'", damaged, "the file is truncated or damaged") from error
    return _rgb(path, channels, (y1 - y0 + 1, x1 - x0 + 1))


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """OpenEXR's library and its Python module print warnings where the one should keep quiet and the other raise."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept = [os.dup(1), os.dup(2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            yield
    finally:
        for number, copy in zip((1, 2), kept, strict=True):
            os.dup2(copy, number)
        for descriptor in (*kept, nowhere):
            os.close(descriptor)


def _rgb(path: Path, channels: dict[str, NDArray], shape: tuple[int, int]) -> NDArray[np.float32]:
    """R, G, B, else Y, of the unnamed layer, else of the first layer that has them."""
    layers = sorted({name.rpartition(".")[0] for name in channels})
    for layer in layers:
        prefix = f"{layer}." if layer else ""
        for names in ("RGB", "rgb", "YYY"):
            if names == "YYY" and prefix + "RY" in channels:
                raise EvalsuiteError(path, "subsampled luminance/chroma channels", "R, G, B or Y", "convert it to RGB")
            if all(prefix + c in channels for c in names):
                planes = [channels[prefix + c] for c in names]
                for plane in planes:
                    if plane.shape != shape:
                        raise EvalsuiteError(path, f"pixels of shape {plane.shape}", f"{shape}", "the file is damaged")
                return np.stack(planes, axis=-1).astype(np.float32)
    raise EvalsuiteError(path, f"the channels {', '.join(sorted(channels)) or 'none'}", "R, G, B or Y")


def _read_hdr(path: Path) -> NDArray[np.float32]:
    """Radiance RGBE; Mitsuba's own reader gives the same texels, but can end the process over a damaged file."""
    return radiance_hdr.decode(read_bytes(path), path, MAX_TEXELS)
