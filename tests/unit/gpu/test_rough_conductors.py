"""split-sum, glossy-isotropic-3d, glossy-warped and diffuse-sh9-windowed: twins with coloured metals, energy, limits."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu import worker
from evalsuite.gpu.plan import cannot_stand_for
from evalsuite.gpu.prefilter import brdf_table
from evalsuite.gpu.techniques import TECHNIQUES
from evalsuite.math import cubemap, fresnel, microfacet, phong, sh, view_maps
from evalsuite.math.sphere import latlong_directions, latlong_lookup

from .helpers import FURNACE, camera, material, noise, ramp, scene, sphere_mesh, visible
from .helpers import environment as environment_of

GOLD = {"eta": (0.2, 0.9, 1.1), "k": (3.9, 2.4, 2.2)}
MIRROR = {"eta": 0.0, "k": 1.0}
ROUGH = ("split-sum", "glossy-isotropic-3d", "glossy-warped")


def metal(alpha=0.2, distribution="ggx", index=GOLD, **more):
    return material("roughconductor", name="subject", alpha=alpha, distribution=distribution, **index, **more)


def rendered(env, subject, technique, given=(), size=(32, 32)):
    s = scene(env, subject, subject=("subject",), size=size)
    drawing = worker.render(s, technique, dict(given), supersample=1)
    mask, normal, to_view = visible(s)
    front = (normal * to_view).sum(-1) > 0.05
    assert front.sum() > 200
    return drawing, drawing.image[mask][front], normal[front], to_view[front]


@pytest.mark.parametrize(("technique", "subject", "given"), [
    ("split-sum", metal(0.37, specular_reflectance=(0.5, 0.6, 0.7)), {"map_size": 32, "samples": 16}),
    ("split-sum", metal(0.1), {"map_size": 32, "prefilter": "quadrature"}),
    ("glossy-isotropic-3d", metal(0.3, "beckmann", specular_reflectance=0.5), {"map_size": 16, "slices": 5, "lobes": 2}),
    ("glossy-isotropic-3d", metal(0.3), {"map_size": 16, "slices": 5, "cosine": "outside"}),
    ("glossy-warped", metal(0.3, "beckmann", specular_reflectance=(0.5, 0.6, 0.7)), {"map_size": 12}),
    ("glossy-warped", metal(0.2), {"map_size": 8, "views": 42}),
    ("diffuse-sh9-windowed", material("diffuse", name="subject", reflectance=0.5), {"window": "laplacian", "size": 0.1}),
    ("diffuse-sh9-windowed", material("diffuse", name="subject", reflectance=0.5), {"window": "lanczos", "size": 3}),
])  # fmt: skip
def test_coloured_metals_and_choices_are_their_twins(technique, subject, given):
    env = noise(9, 16)
    drawing, picture, normal, to_view = rendered(env, subject, technique, {"face_size": 16, **given})
    twin = TECHNIQUES[technique].twin(env, normal, to_view, subject.parameters, drawing.parameters)
    assert twin.mean() > 0.1
    assert np.abs(picture - twin).max() / twin.mean() < 2e-4


def mitsubas_albedo(distribution, alpha, cosine, index):
    """What Mitsuba's BSDF reflects of a constant map: tests/unit/reference/test_microfacet_twin.py holds this to Mitsuba."""
    eta, k = (np.broadcast_to(np.asarray(index[name], float), 3) for name in ("eta", "k"))
    return microfacet.albedo(distribution, alpha, cosine, lambda c: fresnel.fresnel_conductor(c[..., None], eta, k))


@pytest.mark.parametrize(("technique", "distribution", "index", "bound"), [
    ("split-sum", "ggx", MIRROR, 2e-3),  # the table's interpolation
    ("split-sum", "ggx", GOLD, 0.03),  # Schlick's Fresnel
    ("glossy-isotropic-3d", "ggx", GOLD, 0.01), ("glossy-isotropic-3d", "beckmann", MIRROR, 0.01),  # linear between slices
    ("glossy-warped", "ggx", GOLD, 0.1), ("glossy-warped", "beckmann", MIRROR, 0.1),  # fixed views see F and G at other angles
])  # fmt: skip
def test_furnace_reflects_the_albedo(technique, distribution, index, bound):
    _, picture, normal, to_view = rendered(FURNACE, metal(0.3, distribution, index), technique, {"face_size": 16})
    expected = mitsubas_albedo(distribution, 0.3, (normal * to_view).sum(-1), index) * FURNACE.radiance[0, 0]
    assert expected.std() > 0.001
    np.testing.assert_allclose(picture, expected, rtol=bound)


def test_published_normalisation_reflects_too_much():
    inside, outside = (rendered(FURNACE, metal(0.5, index=MIRROR), "glossy-isotropic-3d", {"face_size": 16, "cosine": c})[1]
                       for c in ("inside", "outside"))  # fmt: skip
    assert (outside / inside).max() == pytest.approx(1.8, abs=0.15)


@pytest.mark.parametrize("technique", ROUGH)
def test_mirror_limit(technique):
    """α → 0 on a map of degree 2: L(r) itself."""
    coefficients = np.random.default_rng(8).normal(size=(9, 3)) * 0.1
    coefficients[0] = 3.0
    env = environment_of(sh.basis(latlong_directions(64, 128)) @ coefficients)
    given = {"face_size": 64, **({"map_size": 64} if technique != "split-sum" else {})}
    _, picture, normal, to_view = rendered(env, metal(0.01, index=MIRROR), technique, given)
    expected = latlong_lookup(env.radiance, phong.reflect(to_view, normal))
    central = (normal * to_view).sum(-1) > 0.3
    # Texels of the maps are 0.06 rad apart: first-order errors of half of that on an octahedral map's creases.
    np.testing.assert_allclose(picture[central], expected[central], rtol=0.03)
    assert np.sqrt(((picture[central] / expected[central] - 1) ** 2).mean()) < 0.01


def test_a_fixed_view_shows_its_own_integral():
    """An almost orthographic camera in a fixed view's direction: one map alone, which is the integral itself."""
    fixed = view_maps.views(12)[0][3]
    env, subject = ramp(), metal(0.4)
    s = scene(env, subject, subject=("subject",), meshes=[sphere_mesh(96, 48)],
              view=camera((24, 24), origin=tuple(400 * fixed), fov=0.32))  # fmt: skip
    picture = worker.render(s, "glossy-warped", {"face_size": 32, "map_size": 64}, 1).image
    mask, normal, to_view = visible(s)
    front = (normal * to_view).sum(-1) > 0.3
    level0 = cubemap.resample_latlong(env.radiance, env.to_world, 32)
    d, omega = cubemap.texel_directions(32).reshape(-1, 3), np.tile(cubemap.texel_solid_angles(32).ravel(), 6)
    exact = []
    for n, v in zip(normal[front], to_view[front], strict=True):
        half = (d + v) / np.linalg.norm(d + v, axis=1, keepdims=True)
        f = microfacet.lobe("ggx", 0.4, n @ v, d @ n, half @ n)[:, None]
        f = f * fresnel.fresnel_conductor(np.clip(half @ v, 0, 1)[:, None], *GOLD.values())
        exact.append((f * level0.reshape(-1, 3) * omega[:, None]).sum(0))
    error = np.abs(picture[mask][front] / exact - 1)
    assert front.sum() > 250 and error.max() < 0.03 and error.mean() < 0.005


def test_two_lobes_are_nearer_to_the_integral_than_one():
    env, subject = noise(9, 16), metal(0.4, index=MIRROR)
    level0 = cubemap.resample_latlong(env.radiance, env.to_world, 32)
    d, omega = cubemap.texel_directions(32).reshape(-1, 3), np.tile(cubemap.texel_solid_angles(32).ravel(), 6)
    errors = []
    for lobes in (1, 2):
        _, picture, normal, to_view = rendered(env, subject, "glossy-isotropic-3d", {"face_size": 32, "lobes": lobes})
        half = d[None] + to_view[:, None]
        half /= np.linalg.norm(half, axis=-1, keepdims=True)
        cosines = (normal * to_view).sum(-1)[:, None], normal @ d.T, (half * normal[:, None]).sum(-1)
        exact = (microfacet.lobe("ggx", 0.4, *cosines) * omega) @ level0.reshape(-1, 3)
        errors.append(np.sqrt(((picture - exact) ** 2).mean()) / exact.mean())
    assert errors[1] < 0.6 * errors[0] and errors[0] < 0.3


def test_brdf_table():
    cosine, alpha = np.array([0.02, 0.1, 0.5, 0.97]), (0.05, 0.2, 0.7)
    for a in alpha:
        np.testing.assert_allclose(brdf_table.lookup(cosine, a), microfacet.split_sum_table([a], cosine, 128)[0], atol=1.5e-3)
    texels = np.frombuffer(brdf_table.texture().read(), np.float32).reshape(brdf_table.HEIGHT, brdf_table.WIDTH, 2)
    np.testing.assert_allclose(texels, brdf_table.values(), rtol=1e-6)


def test_what_cannot_be_drawn_is_said():
    assert "Beckmann" in cannot_stand_for(TECHNIQUES["split-sum"], scene(FURNACE, metal(0.2, "beckmann")))
    meshes = [sphere_mesh(radius=0.5, centre=(-1, 0, 0)), sphere_mesh(radius=0.5, centre=(1, 0, 0), material=1)]
    other = material("roughconductor", name="other", alpha=0.4, distribution="ggx", **GOLD)
    s = scene(FURNACE, metal(0.2), other, meshes=meshes, subject=("subject",))
    for technique in ("glossy-isotropic-3d", "glossy-warped"):
        with pytest.raises(EvalsuiteError, match=r"got alpha 0\.4, expected alpha 0\.2"):
            worker.render(s, technique, {"face_size": 16, "map_size": 16}, 1)
    assert worker.render(s, "split-sum", {"face_size": 16, "map_size": 32}, 1).image.any()
    with pytest.raises(EvalsuiteError, match="12 or 42"):
        worker.resolve(s, "glossy-warped", {"views": 13})


def test_no_window_lets_irradiance_be_negative():
    """A lone sun: nine coefficients alone give negative radiance at its back, windowed ones do not, and the front darkens."""
    radiance = np.zeros((33, 64, 3))
    radiance[12, 40] = 1000.0
    env = environment_of(radiance)
    clay = material("diffuse", name="subject", reflectance=0.8)
    pictures = {}
    for name, given in (
        ("diffuse-sh9", {}),
        *(("diffuse-sh9-windowed", {"window": w}) for w in ("hann", "lanczos", "laplacian")),
    ):
        images = []
        for origin in ((0, 0.5, 4.0), (0, -0.5, -4.0)):
            s = scene(env, clay, subject=("subject",), size=(32, 32), origin=origin)
            drawing = worker.render(s, name, given, 1)
            images.append(drawing.image[visible(s)[0]])
        pictures[given.get("window", "plain")] = np.concatenate(images)
        if given:
            assert any("least irradiance -" in note and f"{given['window']} window" in note for note in drawing.notes)
    plain = pictures.pop("plain")
    assert plain.min() < -0.03 * plain.max()  # 3/32 − 2/15 = −0.0396 of the sun's own irradiance at the worst n
    for window in pictures.values():
        assert window.min() > -1e-5 * plain.max() and window.max() < plain.max()


def test_map_sizes_are_filled():
    s = scene(FURNACE, metal(0.1), subject=("subject",))
    assert worker.resolve(s, "glossy-isotropic-3d", {})["map_size"] == 128
    assert worker.resolve(s, "glossy-isotropic-3d", {"alpha": 0.01})["map_size"] == 256
    assert worker.resolve(s, "glossy-warped", {"alpha": 0.5})["map_size"] == 32
