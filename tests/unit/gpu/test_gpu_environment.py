"""The environment on the GPU against its float64 twin and against what hardware is meant to do."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu import camera, context, environment, worker
from evalsuite.math import cubemap
from evalsuite.math.sphere import latlong_lookup
from evalsuite.scene.model import Camera

from .helpers import FURNACE, hardware_lookup, look_at, material, noise, ramp, rotation, scene
from .helpers import environment as environment_of


def test_probe():
    found = worker.probe()
    assert found["version_code"] >= 430 and found["max_cube_size"] >= 1024
    assert isinstance(found["software"], bool) and found["renderer"]


def test_background_is_the_maps_look_up_along_every_view_ray():
    turned = noise(33, 64, to_world=rotation())
    view = Camera(look_at((1, 2, 3), (0.3, 0.1, -5)), 100.0, (60, 40), (10, 5, 40, 30), (0.05, -0.08))
    background = worker.gbuffer(scene(turned, material("diffuse"), view=view), 1).background
    # The same rays from the camera's definition: p on the film ↔ (½ − ½cx/z, ½ − ½acy/z), moved by the principal point.
    c = 1 / np.tan(np.radians(100.0) / 2)
    px, py = np.meshgrid(np.arange(40) + 0.5, np.arange(30) + 0.5)
    fx, fy = (px + 10) / 60 + 0.05, (py + 5) / 40 - 0.08
    local = np.stack([(1 - 2 * fx) / c, (1 - 2 * fy) / (c * 1.5), np.ones_like(fx)], -1)
    expected = latlong_lookup(turned.radiance, local @ view.to_world[:3, :3].T @ rotation())
    # float32 atan: 4e-6 of a turn on maps of 64 columns that vary by ~5 a texel.
    np.testing.assert_allclose(background, expected, atol=3e-3)
    assert np.abs(background - expected).mean() < 1e-4


@pytest.mark.parametrize("make", [ramp, noise])
@pytest.mark.parametrize("to_world", [np.eye(3), rotation(), np.diag([1.0, 1.0, -1.0])])
def test_cube_is_its_float64_twin(make, to_world):
    env = environment_of(make().radiance, to_world)
    twin = cubemap.resample_latlong(env.radiance, to_world, 16)
    # Means of sub-samples: single float32 look-ups err by 1e-4 near seams of white noise.
    np.testing.assert_allclose(environment.of(env).cube(16).level0, twin, atol=2e-4)


@pytest.mark.parametrize("face", range(6))
def test_one_bright_texel_lands_where_it_should(face):
    direction = cubemap.face_to_direction(face, 0.7, 0.2)
    radiance = np.zeros((65, 128, 3), np.float32)
    u, v = np.arctan2(direction[0], -direction[2]) / (2 * np.pi) % 1, np.arccos(direction[1]) / np.pi
    radiance[round(v * 64), int(u * 128)] = 100
    level0 = environment.of(environment_of(radiance)).cube(16).level0
    found, row, column = np.unravel_index(level0[..., 0].argmax(), (6, 16, 16))
    assert found == face
    assert abs((column + 0.5) / 16 - 0.7) < 0.07 and abs((row + 0.5) / 16 - 0.2) < 0.07


def test_hardware_mips_are_boxes_on_each_face():
    """glGenerateMipmap may filter otherwise on another driver: then twins, and the papers' assumption, do not hold there."""
    cube = environment.of(noise(33, 64)).cube(32)
    for level, texels in enumerate(cubemap.box_mips(cube.level0)):
        width = texels.shape[1]
        found = hardware_lookup(cube.texture, cubemap.texel_directions(width).reshape(-1, 3), float(level))
        # Texel centres: float32 rounding of the look-up coordinate alone, against neighbours that differ by up to ~5.
        # GPUs round bilinear weights to 8 bits, which the centre's own weight of 1 is spared.
        np.testing.assert_allclose(found, texels.reshape(-1, 3), atol=2e-4, err_msg=context.get().info["GL_RENDERER"])


def test_hardware_look_up_is_seamless_and_its_twin():
    cube = environment.of(noise(33, 64)).cube(8)
    rng = np.random.default_rng(6)
    directions = rng.normal(size=(4000, 3))
    directions[:500, 1] = directions[:500, 0] * rng.uniform(0.98, 1.02, 500)  # along edges
    directions[500:800] = rng.choice([-1, 1], (300, 3)) * rng.uniform(0.9, 1.0, (300, 3))  # about corners
    lod = rng.uniform(-0.5, 4.0, 4000)
    found, twin = hardware_lookup(cube.texture, directions, lod), cube.sampler.lookup(directions, lod)
    # GPUs hold bilinear and MIP weights to 8 bits (1/256 of neighbours that differ by up to 5); llvmpipe to float32.
    bound = 2e-5 if context.is_software(context.get()) else 3e-2
    np.testing.assert_allclose(found, twin, atol=bound)


def test_energy_residual_is_reported_and_small():
    for env in (FURNACE, ramp(), noise(65, 128)):
        for size in (16, 64):
            assert abs(environment.of(env).cube(size).energy_residual) < 2e-3
    cube = environment.of(noise(65, 128)).cube(64)
    whole = environment.of(noise(65, 128)).integral
    residual = cubemap.integral(cube.level0) @ environment.LUMINANCE / (whole @ environment.LUMINANCE) - 1
    assert cube.energy_residual == pytest.approx(residual, abs=1e-12)


def test_resources_are_kept_by_content():
    assert environment.of(noise(seed=1)) is environment.of(noise(seed=1))
    assert environment.of(noise(seed=1)) is not environment.of(noise(seed=2))


def test_maps_without_energy_or_of_one_row():
    zero = environment_of(np.zeros((4, 8, 3)))
    assert environment.of(zero).cube(16).energy_residual == 0 and not environment.of(zero).has_energy
    row = environment_of(np.arange(24).reshape(1, 8, 3))
    twin = cubemap.resample_latlong(row.radiance, np.eye(3), 16)
    np.testing.assert_allclose(environment.of(row).cube(16).level0, twin, atol=5e-3)  # the pole's column is undefined


def test_a_map_too_large_is_refused_in_one_line():
    limit = context.get().info["GL_MAX_TEXTURE_SIZE"]
    with pytest.raises(EvalsuiteError, match="at most"):
        environment.GpuEnvironment(environment_of(np.zeros((1, limit + 1, 3))))


def test_depth_planes_are_drawn_in_but_never_beyond_the_cameras():
    s = scene(FURNACE, material("diffuse"))
    near, far = camera.depth_range(s)
    assert 2.9 < near < 3.2 and 4.9 < far < 5.2
