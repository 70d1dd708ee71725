"""Faults planted in a copy of the code, in shaders, Mitsuba plugins and metrics: each must fail the gate, and taken back pass it.

Faults are of the kinds that happen: an off-by-one level, swapped faces, a missing cosine or 1/π, a wrong sRGB curve, a seam."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from small_scene import scene_xml

from evalsuite.image import exr

REPO = Path(__file__).resolve().parents[2]
GPU, LIBRARY, TECHNIQUES = "gpu/glsl", "gpu/glsl/library", "gpu/techniques"
DRAWN = ("glossy-mcguire", "diffuse-sh9", "diffuse-topmip", "mirror-cube", "mirror-sphere", "mirror-paraboloid", "fresnel-blend",
         "split-sum", "glossy-phong-map")  # fmt: skip
REPORT = f"""
size = [40, 32]
[[group]]
scenes = ["small.xml"]
techniques = {list(DRAWN)}
targets = ["unoccluded"]
parameters = {{ exponent = 12 }}
"""
#: name: file in evalsuite/, what stands there, what a tired hand writes, verdicts of which the gate must say one.
FAULTS = {
    "level off by one": (f"{LIBRARY}/mcguire.glsl", "return log2(", "return log2(0.5 * ", {"further"}),
    "level without its half": (f"{LIBRARY}/mcguire.glsl", "0.5 * log2(s", "log2(s", {"further"}),
    "coarsest level missed": (
        f"{TECHNIQUES}/diffuse_topmip.glsl",
        "env_max_level - below_top",
        "env_max_level - 3.0",
        {"further"},
    ),
    "swapped SH coefficients": (f"{LIBRARY}/sh.glsl", "n.y * sh[1] + n.z * sh[2]", "n.z * sh[1] + n.y * sh[2]", {"further"}),
    "SH factor": (f"{LIBRARY}/sh.glsl", "(2.0 * PI / 3.0) * one", "PI * one", {"further"}),
    "missing 1/π": (f"{TECHNIQUES}/diffuse_sh9.glsl", "/ PI * irradiance(s.normal)", "* irradiance(s.normal)", {"further"}),
    "normal for reflection": (f"{TECHNIQUES}/mirror_cube.glsl", "reflect(-s.to_view, s.normal)", "s.normal", {"further"}),
    "view the wrong way": (f"{TECHNIQUES}/mirror_sphere.glsl", "reflect(-s.to_view", "reflect(s.to_view", {"further"}),
    "sphere map's rim": (f"{TECHNIQUES}/mirror_sphere.glsl", "0.5 + sphere_scale", "0.5 + 0.98 * sphere_scale", {"further"}),
    "paraboloid seam": (f"{TECHNIQUES}/mirror_paraboloid.glsl", "mix(back.rgb, front.rgb, front.a)", "front.rgb", {"further"}),
    "swapped faces": (
        f"{LIBRARY}/cube_faces.glsl",
        "vec3(1, 0, 0), vec3(-1, 0, 0)",
        "vec3(-1, 0, 0), vec3(1, 0, 0)",
        {"further"},
    ),
    "half-texel shift": (f"{GPU}/latlong.glsl", "u * float(size.x) - 0.5", "u * float(size.x)", {"further", "failed"}),
    "row off by one": (f"{GPU}/latlong.glsl", "v * float(size.y - 1)", "v * float(size.y)", {"further", "failed"}),
    "Fresnel without its half": (f"{LIBRARY}/dielectric.glsl", "0.5 * root_s", "root_s", {"further"}),
    "coat that takes no light": (f"{TECHNIQUES}/fresnel_blend.glsl", "(1.0 - coat * fresnel)", "1.0", {"further"}),
    "roughness without its root": (f"{TECHNIQUES}/split_sum.glsl", "roughness = sqrt(alpha)", "roughness = alpha", {"further"}),
    "plugin's lobe": (
        "reference/bsdfs/phong.py",
        "eval = pdf",
        "eval = staticmethod(lambda wi, wo, e: 0.9 * PhongLobe.pdf(wi, wo, e))",
        {"other truth"},
    ),
    "plugin's Fresnel": ("reference/bsdfs/fresnel_mirror.py", "0.5 * dr.square", "dr.square", {"other truth"}),
    "squared error": (
        "compare/metrics.py",
        "return np.square(image - reference)",
        "return np.square(image - 0.999 * reference)",
        {"other measure"},
    ),
    "sRGB curve": (
        "image/color.py",
        "1.055 * np.maximum(v, 0.0031308) ** (1 / 2.4)",
        "1.055 * np.maximum(v, 0.0031308) ** (1 / 2.2)",
        {"other measure"},
    ),
    "ε of relmse": ("compare/metrics.py", "EPSILON = 0.01", "EPSILON = 0.05", {"other measure"}),
    "mask with its border": (
        "compare/mask.py",
        "binary_erosion(whole, np.ones((3, 3))",
        "binary_erosion(whole, np.ones((1, 1))",
        {"other measure"},
    ),
}


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    root = tmp_path_factory.mktemp("copy")
    for folder in ("evalsuite", "scenes", "reports"):
        shutil.copytree(REPO / folder, root / folder, ignore=shutil.ignore_patterns("__pycache__", "build"))
    shutil.copy(REPO / "pyproject.toml", root)
    rng = np.random.default_rng(3)
    exr.write(root / "map.exr", np.kron(rng.uniform(0.1, 2.0, (8, 16, 3)), np.ones((4, 4, 1))).astype(np.float32))
    emitter = '<emitter type="envmap"><string name="filename" value="map.exr"/></emitter>'
    (root / "small.xml").write_text(scene_xml(emitter, material="subject"), encoding="utf-8")
    (root / "gate.toml").write_text(REPORT, encoding="utf-8")
    return root


@pytest.fixture(scope="module")
def call(copy, evalsuite, tmp_path_factory):
    store = tmp_path_factory.mktemp("store")

    def type_(*words):
        return evalsuite(*words, cwd=copy, PYTHONPATH=str(copy), EVALSUITE_CACHE=str(store))

    ran = type_("run", "gate.toml", "--target-error", "0.05", "--no-ledger")
    assert ran.code == 0, ran.err
    assert type_("bless", "gate.toml").code == 0
    assert type_("check", "gate.toml").code == 0
    return type_


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_planted_fault_fails_the_gate(copy, call, fault):
    file, old, new, verdicts = FAULTS[fault]
    path = copy / "evalsuite" / file
    right = path.read_text(encoding="utf-8")
    assert right.count(old) >= 1, file
    path.write_text(right.replace(old, new), encoding="utf-8")
    try:
        done = call("check", "gate.toml", "--json")
    finally:
        path.write_text(right, encoding="utf-8")
    assert done.code == 1, done.out[-2000:] + done.err
    found = {cell["verdict"] for cell in json.loads(done.out)["cells"] if not cell["passed"]}
    assert found & verdicts, found


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_without_a_fault_it_passes_with_fresh_references_too(call):
    for seed in range(1, 51):
        done = call("check", "gate.toml", "--seed", seed)
        assert done.code == 0, done.out + done.err
