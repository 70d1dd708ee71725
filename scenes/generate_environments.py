"""Writes a built-in environment anew: `python scenes/generate_environments.py NAME [-o FILE]`, or `--all`.

Every map is lat-long in Mitsuba's `envmap` layout (see `evalsuite.math.sphere`), y up, linear Rec.709 radiance. The closed
forms stand in `docs/environments.md`. `sunsky`, `office`, `cathedral` and `studio` need Mitsuba; the others NumPy alone. All
are deterministic; the path-traced rooms take minutes.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evalsuite.math.band_noise import band_noise
from evalsuite.math.sphere import latlong_directions, latlong_solid_angles, latlong_to_direction

HERE = Path(__file__).resolve().parent
Map = NDArray[np.float64]

#: `cosine`: L(ω) = max(0, ω·a), hence E(n) = ⅔ (sin γ + (π − γ) cos γ), cos γ = n·a.
COSINE_AXIS = np.array([2.0, 6.0, 3.0]) / 7.0

#: `sh2`: the nine real SH coefficients (l, m) = (0,0) (1,−1) (1,0) (1,1) (2,−2) … (2,2) of L, by RGB. L > 0 everywhere.
SH2_COEFFICIENTS = np.array(
    [
        [3.00, 2.80, 2.60],
        [0.70, 0.60, 0.50],
        [-0.35, 0.25, 0.45],
        [0.55, -0.30, 0.20],
        [0.25, -0.20, 0.30],
        [-0.30, 0.35, 0.20],
        [0.20, -0.25, 0.35],
        [0.30, 0.20, -0.25],
        [-0.25, 0.30, 0.20],
    ]
)

#: `coloured-cube`: radiance of the faces +x −x +y −y +z −z; opposite faces carry complementary colours.
CUBE_COLOURS = np.array(
    [[1.0, 0.06, 0.06], [0.06, 0.9, 0.9], [1.0, 0.9, 0.06], [0.06, 0.1, 1.0], [0.06, 0.9, 0.1], [0.95, 0.06, 0.9]]
)

#: `sunsky`: direction to the sun (elevation 40°), and the albedo of the Lambertian ground that fills the lower half.
SUN_DIRECTION = np.array([0.55, np.sin(np.radians(40.0)), 0.0])
SUN_DIRECTION[2] = np.sqrt(1.0 - (SUN_DIRECTION**2).sum())
TURBIDITY = 7.0  # a little hazy: the sun stays below 10⁵ × the sky's mean
GROUND_ALBEDO = 0.2


def real_sh2(directions: Map) -> Map:
    """The nine orthonormal real spherical harmonics of degree ≤ 2, (..., 3) → (..., 9)."""
    x, y, z = np.moveaxis(directions, -1, 0)
    a, b, c = np.sqrt(1 / (4 * np.pi)), np.sqrt(3 / (4 * np.pi)), np.sqrt(15 / (4 * np.pi))
    zonal = np.sqrt(5 / (16 * np.pi)) * (3 * z * z - 1)
    second = [c * x * y, c * y * z, zonal, c * x * z, c / 2 * (x * x - y * y)]
    return np.stack([np.full_like(x, a), b * y, b * z, b * x, *second], axis=-1)


def grey(values: Map) -> Map:
    return np.repeat(values[..., None], 3, axis=-1)


def cell_directions(height: int, width: int, samples: int) -> Map:
    """Directions (s², H, W, 3) on a regular grid over each texel's cell (half a texel either way; half as tall at the poles)."""
    offset = (np.arange(samples) + 0.5) / samples - 0.5
    rows, columns = np.arange(height)[:, None], np.arange(width)[None, :]
    low, high = np.maximum(rows - 0.5, 0), np.minimum(rows + 0.5, height - 1)
    return np.stack(
        [
            latlong_to_direction((columns + 0.5 + du) / width, (low + (dv + 0.5) * (high - low)) / (height - 1))
            for dv in offset
            for du in offset
        ]
    )


def furnace() -> Map:
    return np.ones((32, 64, 3))


def cosine() -> Map:
    return grey(np.maximum(latlong_directions(256, 512) @ COSINE_AXIS, 0.0))


def sh2() -> Map:
    return real_sh2(latlong_directions(128, 256)) @ SH2_COEFFICIENTS


def coloured_cube() -> Map:
    """Each texel is the mean over its cell, so that only the texels on an edge are mixed."""
    total = np.zeros((512, 1024, 3))
    for directions in cell_directions(512, 1024, 4):
        axis = np.abs(directions).argmax(-1)
        negative = np.take_along_axis(directions, axis[..., None], -1)[..., 0] < 0
        total += CUBE_COLOURS[2 * axis + negative]
    return total / 16


def overcast() -> Map:
    """CIE overcast sky L = (1 + 2 cos θ)/3 of zenith radiance 1 above a Lambertian ground: E_horizontal = 7π/9."""
    height = latlong_directions(256, 512)[..., 1]
    return grey(np.where(height > 0, (1 + 2 * height) / 3, GROUND_ALBEDO * 7 / 9))


def sunsky() -> Map:
    """Mitsuba's `sunsky` averaged over each texel's cell (4 samples, 256 near the sun: point samples would miss or double
    the sun's energy), above a Lambertian ground lit by it."""
    height, width = 512, 1024
    mi, dr = mitsuba()
    # The plugin is z-up: y-up (x, y, z) ↦ (x, −z, y).
    sun = [float(SUN_DIRECTION[0]), float(-SUN_DIRECTION[2]), float(SUN_DIRECTION[1])]
    sky = mi.load_dict({"type": "sunsky", "sun_direction": sun, "turbidity": TURBIDITY})

    def radiance(directions: Map) -> Map:
        x, y, z = directions.reshape(-1, 3).T
        si = dr.zeros(mi.SurfaceInteraction3f, x.size)
        si.wi = -mi.Vector3f(x, -z, y)
        values = np.array(sky.eval(si)).reshape(3, -1).T.reshape(directions.shape)
        return np.where(directions[..., 1:2] > 0, values, 0.0)

    image = np.mean([radiance(directions) for directions in cell_directions(height, width, 2)], axis=0)
    near = latlong_directions(height, width) @ SUN_DIRECTION > np.cos(np.radians(1.5))
    image[near] = np.mean([radiance(d[near]) for d in cell_directions(height, width, 16)], axis=0)

    cosines = np.maximum(latlong_directions(height, width)[..., 1], 0) * latlong_solid_angles(height, width)
    ground = GROUND_ALBEDO / np.pi * (cosines[..., None] * image).sum((0, 1))
    above = cell_directions(height, width, 2)[..., 1:2].mean(0) > 0
    return np.where(above, image, ground)


def office() -> Map:
    return path_traced("office", samples=4096)


def cathedral() -> Map:
    return path_traced("cathedral", samples=8192)


def chapel() -> Map:
    return path_traced("chapel", samples=2048)


def basilica() -> Map:
    return path_traced("basilica", samples=2048)


def studio() -> Map:
    return path_traced("studio", samples=4096, width=256, height=128)


def path_traced(room: str, samples: int, width: int = 512, height: int = 256) -> Map:
    """The room of `rooms/<room>.xml`, path-traced once from its camera's position along the world's axes; each texel is the
    mean over its cell. samples: per texel. No denoiser: a map must not carry a filter's invention."""
    mi, dr = mitsuba()
    scene = mi.load_file(str(HERE / "rooms" / f"{room}.xml"))
    integrator, sensor = scene.integrator(), scene.sensors()[0]
    eye = mi.Point3f(np.array(sensor.world_transform().translation()).ravel().tolist())
    count = width * height
    batch = 128  # samples a kernel launch: a power of two sums alike in any order of threads

    index = dr.arange(mi.UInt32, count)
    column, row = mi.Float(index % width), mi.Float(index // width)
    low, high = dr.maximum(row - 0.5, 0), dr.minimum(row + 0.5, height - 1)

    def add_sample(i, total, sampler):
        # latlong_to_direction of evalsuite.math.sphere, in Dr.Jit
        jitter = sampler.next_2d()
        sin_phi, cos_phi = dr.sincos(2 * dr.pi * (column + jitter.x) / width)
        sin_theta, cos_theta = dr.sincos(dr.pi * dr.lerp(low, high, jitter.y) / (height - 1))
        ray = mi.RayDifferential3f(eye, mi.Vector3f(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi))
        radiance, _, _ = integrator.sample(scene, sampler, ray)
        return i + 1, total + radiance, sampler

    image = np.zeros((3, count))
    for seed in range(samples // batch):
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed, count)
        start = (mi.UInt32(0), mi.Color3f(0), sampler)
        _, total, _ = dr.while_loop(start, lambda i, *_: i < batch, add_sample)
        image += np.array(total, dtype=np.float64).reshape(3, count) / samples
    return image.T.reshape(height, width, 3)


def mitsuba():
    """The modules (mitsuba, drjit), in the LLVM variant."""
    from evalsuite.reference.variants import activate

    mi = activate()  # finds an LLVM first: Dr.Jit must not be imported before
    import drjit as dr

    return mi, dr


@dataclass(frozen=True)
class Generator:
    """build: returns the radiance (H, W, 3). half: stored as half floats (else float32, where exactness is the point)."""

    build: Callable[[], Map]
    half: bool = True


GENERATORS: dict[str, Generator] = {
    "furnace": Generator(furnace),
    "cosine": Generator(cosine, half=False),
    "sh2": Generator(sh2, half=False),
    "coloured-cube": Generator(coloured_cube),
    "overcast": Generator(overcast),
    "sunsky": Generator(sunsky),
    "office": Generator(office),
    "cathedral": Generator(cathedral),
    "chapel": Generator(chapel),
    "basilica": Generator(basilica),
    "studio": Generator(studio),
}


def generator_of(name: str) -> Generator:
    """That of a shipped environment, or of the family `band-ℓ`."""
    if name.startswith("band-"):
        return Generator(lambda: grey(band_noise(int(name.removeprefix("band-")))), half=False)
    return GENERATORS[name]


def make(name: str, file: Path) -> None:
    """Build the environment `name` and write it to `file` (EXR). The pole rows carry one value each: they are one point."""
    import OpenEXR

    generator = generator_of(name)
    radiance = generator.build()
    radiance[[0, -1]] = radiance[[0, -1]].mean(1, keepdims=True)
    pixels = np.ascontiguousarray(radiance, dtype=np.float16 if generator.half else np.float32)
    if not np.isfinite(pixels).all() or (pixels < 0).any():
        raise ValueError(f"{name}: a texel is negative or overflows half floats")
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"RGB": pixels}) as exr:
        exr.write(str(file))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", nargs="?", choices=GENERATORS)
    parser.add_argument("--all", action="store_true", help="every environment")
    parser.add_argument("-o", "--output", type=Path, help="file (default: scenes/envmaps/NAME.exr)")
    arguments = parser.parse_args()
    if not (arguments.all or arguments.name):
        parser.error("give a NAME or --all")
    for name in GENERATORS if arguments.all else [arguments.name]:
        make(name, arguments.output or HERE / "envmaps" / f"{name}.exr")


if __name__ == "__main__":
    main()
