"""evalsuite: how wrong is a real-time lighting approximation, where and why, beside Mitsuba 3 ground truth.

    import evalsuite as es
    scene     = es.load_scene("scenes/torus.xml", envmap="my.exr")
    image     = es.render(scene, "glossy-mcguire", exponent=64)
    reference = es.reference(scene, "unoccluded", target_error=0.005)
    result    = es.compare(image, reference)

Importing it registers the BSDF plugins `phong` and `blinnphong` with Mitsuba; nothing heavy is imported before it is used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from evalsuite._plugins import install as _install
from evalsuite._plugins import register
from evalsuite.errors import EvalsuiteError, MachineLacks, WorkerFailed

if TYPE_CHECKING:
    from evalsuite.api import compare, load_scene, reference, render

__version__ = "0.1.0"
__all__ = ["EvalsuiteError", "MachineLacks", "WorkerFailed", "compare", "load_scene", "reference", "register", "render"]

_install()
_LAZY = ("compare", "load_scene", "reference", "render")


def __getattr__(name: str) -> object:
    if name in _LAZY:
        from evalsuite import api

        return getattr(api, name)
    raise AttributeError(f"module 'evalsuite' has no attribute '{name}'")
