"""How far a picture is from the reference, where, and how sure that is. Pure NumPy; argument order (image, reference)."""

from __future__ import annotations

from evalsuite._callable import make_callable
from evalsuite.compare.comparison import Comparison, compare
from evalsuite.compare.statistics import Metric

__all__ = ["Comparison", "Metric", "compare"]

make_callable(__name__)
