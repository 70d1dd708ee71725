"""Mitsuba BSDF plugins of the papers' reflection models, written in Python and vectorised by Dr.Jit.

`register()` makes them known to the active Mitsuba variant under the names that scene files use. All are one-sided.
"""

from __future__ import annotations

_registered: set[str] = set()


def register() -> None:
    """Register `phong` and `blinnphong` with the active Mitsuba variant; does nothing the second time."""
    import mitsuba as mi

    from . import blinn_phong, phong
    from .lobe import define_lobe_bsdf

    variant = mi.variant()
    if variant in _registered:
        return
    for name, lobe in {"phong": phong.PhongLobe, "blinnphong": blinn_phong.BlinnPhongLobe}.items():
        plugin = define_lobe_bsdf(name, lobe)
        mi.register_bsdf(name, plugin)
    _registered.add(variant)
