"""Mitsuba BSDF plugins of the papers' reflection models, written in Python and vectorised by Dr.Jit.

`register()` makes them known to the active Mitsuba variant under the names that scene files use. All are one-sided.
"""

from __future__ import annotations

_registered: set[str] = set()


def register() -> None:
    """Register the plugins with the active Mitsuba variant; does nothing the second time."""
    import mitsuba as mi

    from . import blinn_phong, fresnel_mirror, kautz, npr, phong
    from .lobe import define_lobe_bsdf

    variant = mi.variant()
    if variant in _registered:
        return
    lobes = {"phong": phong.PhongLobe, "blinnphong": blinn_phong.BlinnPhongLobe, "kautz": kautz.KautzLobe}
    plugins = {name: define_lobe_bsdf(name, lobe) for name, lobe in lobes.items()}
    plugins[fresnel_mirror.NAME] = fresnel_mirror.define_fresnel_mirror()
    plugins[npr.NAME] = npr.define_npr()
    for name, plugin in plugins.items():
        mi.register_bsdf(name, plugin)
    _registered.add(variant)
