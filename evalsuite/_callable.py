"""`evalsuite.reference` and `evalsuite.compare` are packages and, in the Python interface, functions: both at once."""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType


class _CallablePackage(ModuleType):
    def __call__(self, *arguments: object, **options: object) -> object:
        return getattr(import_module("evalsuite.api"), self.__name__.rpartition(".")[2])(*arguments, **options)


def make_callable(package: str) -> None:
    """Calling the package calls the function of its name in `evalsuite.api`."""
    sys.modules[package].__class__ = _CallablePackage
