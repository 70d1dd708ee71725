"""GGX prefiltering of a cubemap of 256² a face to a full MIP chain, beside programs that users would pick, at equal error.

The truth is quadrature over the tree of the cubemap's texels, at random texels of each level. Ours takes, level by level, the
fewest importance samples (powers of two) with which it is no further from the truth than the other; how many is found before and
not timed. Timed is our GPU path from the cubemap in memory to a texture to draw with, our CPU path (NumPy, float64, one core),
and of the others the process, with its start and files. The mirror's level 0 is copied by all and not compared.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import moderngl
import numpy as np

from benchmarks import timing
from benchmarks.figure import Figure, Limit, NotMeasured
from benchmarks.others import OTHERS, Other
from evalsuite.gpu import context
from evalsuite.gpu.environment import Cube
from evalsuite.gpu.prefilter import maps
from evalsuite.gpu.prefilter.sampled import SampledLobe
from evalsuite.image import exr
from evalsuite.math import cube_tree, cubemap, prefilter, radial_lobe
from evalsuite.math.phong import mean_texel_solid_angle
from evalsuite.math.sphere import latlong_lookup
from evalsuite.scene import builtin

TITLE = "GGX prefiltering of a cubemap to a full MIP chain"
TRUTH = 0.06  # opening of the tree's nodes
MOST = 1 << 14


def measure(quick: bool) -> list[Figure]:
    """Ratios of times for each of the others that is there."""
    found = [other for other in OTHERS if other.found]
    if not found:
        raise NotMeasured("none of the others is on the PATH: " + ", ".join(f"{o.name} ({o.package})" for o in OTHERS))
    width, rounds = (64, 3) if quick else (256, 4)
    radiance = exr.read(builtin.environment_path("office")).astype(np.float64)
    cube = cubemap.SeamlessCube(cubemap.box_mips(latlong_lookup(radiance, cubemap.texel_directions(width))))
    return [figure for other in found for figure in _against(other, cube, rounds)]


def _against(other: Other, cube: cubemap.SeamlessCube, rounds: int) -> list[Figure]:
    width, last = cube.width, cube.width.bit_length() - 1
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        other.write(folder, cube)
        other.run(folder, width)
        theirs, tree = other.read(folder, cube), cube_tree.build(cube.levels[0])
        chain, errors = [_mirror(width)], []
        for level in range(1, last + 1):
            samples, error = _samples(cube, tree, level, float(other.alpha(level / last)), theirs[level])
            chain.append(samples)
            errors.append(error)
        counts = "/".join(str(len(samples.weights)) for samples in chain[1:])
        print(f"  {other.name}: relative rms error of levels 1 to {last}, theirs and ours: "
              + ", ".join(f"{a:.2%} {b:.2%}" for a, b in errors) + f"; samples kept {counts}")  # fmt: skip
        figures = []
        for path, ours in (("GPU", lambda: on_gpu(cube, chain)), ("CPU", lambda: on_cpu(cube, chain))):
            mine, others = timing.rounds_of(ours, lambda: other.run(folder, width), rounds)
            value, ci95 = timing.ratio(others, mine)
            beside = f"{timing.typical(mine)}; {other.name} {timing.typical(others)}, 1024 samples, ours {counts}"
            what = f"{width}² GGX: {other.name} over our {path} path"
            figures.append(Figure(what, value, ci95, rounds, "×", Limit(1.0, least=True), beside))
    return figures


def _mirror(width: int) -> prefilter.SampleSet:
    texel = np.array([mean_texel_solid_angle(width, 0.0)])
    return prefilter.SampleSet(np.array([[0.0, 0.0, 1.0]]), np.ones(1), texel)


def _samples(
    cube: cubemap.SeamlessCube, tree: cube_tree.CubeTree, level: int, alpha: float, theirs: np.ndarray
) -> tuple[prefilter.SampleSet, tuple[float, float]]:
    """The smallest sample set that is no worse than theirs, and both errors. Raises NotMeasured where none is."""
    axes = cubemap.texel_directions(cube.width >> level).reshape(-1, 3)
    some = np.random.default_rng(level).permutation(len(axes))[:150]
    truth = radial_lobe.filter_tree(tree, axes[some], radial_lobe.ggx_at_normal_incidence(alpha), TRUTH)

    def error(picture: np.ndarray) -> float:
        return float(np.sqrt(((picture - truth) ** 2).mean()) / truth.mean())

    limit, count = error(theirs.reshape(-1, 3)[some]), 8
    while count <= MOST:
        samples = prefilter.ggx_at_normal_incidence(alpha, count)
        ours = error(prefilter.filter_cube(cube, axes[some], samples))
        if ours <= limit:
            return samples, (limit, ours)
        count *= 2
    raise NotMeasured(f"level {level}: {MOST} samples are not as near as the other, {ours:.3%} and {limit:.3%}")


def on_gpu(cube: cubemap.SeamlessCube, chain: list[prefilter.SampleSet]) -> None:
    """All levels by compute shader, as a texture to draw with."""
    gl, width = context.get(), cube.width
    source = gl.texture_cube((width, width), 4, dtype="f4")
    rgba = np.ones((width, width, 4), np.float32)
    for face in range(6):
        rgba[..., :3] = cube.levels[0][face]
        source.write(face, rgba.tobytes())
    source.build_mipmaps()
    source.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    made = maps.to_cube(width, [SampledLobe(Cube(source, width, 0.0, 0.0), samples) for samples in chain])
    gl.finish()
    made.release()
    source.release()


def on_cpu(cube: cubemap.SeamlessCube, chain: list[prefilter.SampleSet]) -> list[np.ndarray]:
    """All levels in NumPy: (6, w, w, 3) float64."""
    fresh = cubemap.SeamlessCube(cubemap.box_mips(cube.levels[0]))
    return [prefilter.filter_cube(fresh, cubemap.texel_directions(cube.width >> k), s) for k, s in enumerate(chain)]
