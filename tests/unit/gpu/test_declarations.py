"""What techniques declare, with no OpenGL anywhere."""

from __future__ import annotations

import pickle
import subprocess
import sys

import numpy as np
import pytest

from evalsuite.gpu.drawing import Drawing
from evalsuite.gpu.techniques import TECHNIQUES


def test_the_table_and_the_workers_module_need_no_opengl():
    code = ("import sys, evalsuite.gpu.techniques, evalsuite.gpu.plan, evalsuite.gpu.worker\n"
            "assert not {'moderngl', 'mitsuba', 'drjit'} & set(sys.modules)")  # fmt: skip
    subprocess.run([sys.executable, "-c", code], check=True)


#: Sections A to G of the papers' systems, what practitioners use today, and our oracle.
IDS = """
mirror-sphere mirror-cube mirror-paraboloid mirror-paraboloid-2pass
diffuse-map diffuse-sh9 diffuse-topmip
glossy-phong-map glossy-boxmip glossy-boxmip-lod glossy-boxmip-seamless glossy-mcguire glossy-hierarchical glossy-isotropic-3d
glossy-warped
fresnel-mirror fresnel-add fresnel-blend kautz-combined mcguire-combined
acquire
npr-sketch npr-cool-warm npr-silhouette npr-hatching
shadow-none shadow-wedges shadow-sampled shadow-pcss
split-sum diffuse-sh9-windowed
brute-force
""".split()


def test_ids():
    assert list(TECHNIQUES) == IDS
    assert all(key == technique.id for key, technique in TECHNIQUES.items())


@pytest.mark.parametrize("technique", TECHNIQUES.values(), ids=lambda t: t.id)
def test_declarations_are_whole(technique):
    assert technique.title and technique.paper and technique.equations and technique.assumptions
    assert technique.shader.is_file() and technique.shader.stem == technique.id.replace("-", "_")
    assert technique.target in ("unoccluded", "direct", "near-field", "lookup")
    names = [p.name for p in technique.parameters]
    assert len(set(names)) == len(names)
    for parameter in technique.parameters:
        assert parameter.kind in ("material", "technique") and parameter.meaning and parameter.expected
        if parameter.default is not None:
            assert parameter.parse(parameter.default) == parameter.default
    bsdf = technique.target_bsdf({p.name: p.default for p in technique.parameters})
    assert bsdf["type"] in technique.stands_for


def test_drawings_survive_pickling():
    drawing = Drawing(np.ones((2, 2, 3), np.float32), np.ones((2, 2), np.float32), fit={"exponent": 3.0})
    again = pickle.loads(pickle.dumps(drawing))
    assert again.fit == drawing.fit and np.array_equal(again.image, drawing.image)
