"""Makes `phong` and `blinnphong` known to Mitsuba as soon as both evalsuite and Mitsuba are imported, in either order and
for every variant, without importing Mitsuba for those who do not need it."""

from __future__ import annotations

import importlib.abc
import importlib.util
import os
import sys


def register() -> None:
    """Register our BSDF plugins with Mitsuba: with the current variant and with each one set later."""
    _prefer_packaged_llvm()
    import mitsuba as mi

    def on_variant(_old: str | None, new: str | None) -> None:
        # The scalar variants would call Python for every ray; they are not offered the plugins.
        if new and "rgb" in new and not new.startswith("scalar"):
            from evalsuite.reference.bsdfs import register as register_here

            register_here()

    if not getattr(mi, "_evalsuite_registered", False):
        mi._evalsuite_registered = True
        mi.detail.add_variant_callback(on_variant)
    on_variant(None, mi.variant())


def _prefer_packaged_llvm() -> None:
    """Dr.Jit looks for a system LLVM, and aborts on some; the packaged one that evalsuite depends on is the better guess."""
    if "drjit" not in sys.modules and "DRJIT_LIBLLVM_PATH" not in os.environ:
        path = os.path.join(sys.prefix, "lib", "libLLVM.so")
        if os.path.exists(path):
            os.environ["DRJIT_LIBLLVM_PATH"] = path


class _AfterMitsuba(importlib.abc.MetaPathFinder):
    """Lets the other finders import `mitsuba`, then registers the plugins."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> object:
        if name != "mitsuba":
            return None
        sys.meta_path.remove(self)
        _prefer_packaged_llvm()
        spec = importlib.util.find_spec(name)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def exec_module(module: object) -> None:
                execute(module)
                register()

            spec.loader.exec_module = exec_module
        return spec


def install() -> None:
    """Register now if Mitsuba is there, else when it comes."""
    if "mitsuba" in sys.modules:
        register()
    else:
        sys.meta_path.insert(0, _AfterMitsuba())
