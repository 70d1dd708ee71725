"""Colour scales: one definition each for the preview, the legend's CSS gradient and FlipBook's GLSL, so that all agree."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare.regions import ORDER, OUTLINE

#: A stop is (value, sRGB code values 0–255); colours are interpolated linearly in sRGB, as CSS gradients do.
Stop = tuple[float, tuple[int, int, int]]

_DIVERGING = ((-1.0, (18, 59, 125)), (-0.5, (88, 150, 205)), (0.0, (245, 245, 243)), (0.5, (226, 121, 88)), (1.0, (138, 16, 38)))
# Nine equidistant samples of matplotlib's magma (CC0), which FLIP's authors use.
_MAGMA = (
    (0, 0, 4), (28, 16, 68), (79, 18, 123), (129, 37, 129), (181, 54, 122), (229, 80, 100), (251, 135, 97), (254, 194, 135),
    (252, 253, 191),
)  # fmt: skip
#: None, the regions of ORDER, the outline of the blob. Red and green of like lightness do not meet.
REGIONS = (
    (236, 236, 234), (255, 214, 64), (120, 126, 134), (168, 120, 200), (60, 40, 110), (196, 60, 40), (240, 150, 90),
    (40, 120, 150), (150, 205, 180), (214, 226, 240), (0, 0, 0),
)  # fmt: skip
_Z = ((2.0, (250, 224, 140)), (4.0, (240, 150, 70)), (10.0, (178, 30, 45)), (20.0, (70, 5, 40)))


@dataclass(frozen=True)
class Scale:
    """stops: ascending in value. ticks: (value, label) drawn under the bar. caption: what the colours say."""

    stops: tuple[Stop, ...]
    ticks: tuple[tuple[float, str], ...]
    caption: str

    @property
    def low(self) -> float:
        return self.stops[0][0]

    @property
    def high(self) -> float:
        return self.stops[-1][0]

    def position(self, value: float) -> float:
        """Where a value stands on the bar [% from the left]."""
        return round(100 * (value - self.low) / (self.high - self.low), 2)

    def colours(self, values: NDArray) -> NDArray[np.float32]:
        """(H, W) values → (H, W, 3) sRGB in [0, 1]; beyond the ends the end colours."""
        at, codes = np.array([s for s, _ in self.stops]), np.array([c for _, c in self.stops]) / 255
        return np.stack([np.interp(values, at, codes[:, k]) for k in range(3)], axis=-1).astype(np.float32)

    @property
    def css(self) -> str:
        """A CSS linear-gradient from left to right."""
        return "linear-gradient(to right, " + ", ".join(f"rgb{c} {self.position(v)}%" for v, c in self.stops) + ")"

    @property
    def glsl(self) -> str:
        """Body for FlipBook's shader: `rgb` holds the pixel and takes linear Rec.709. NaN becomes magenta."""
        lines = ["float v = (rgb.x + rgb.y + rgb.z) / 3.0;", "bool bad = anynan(rgb);", f"vec3 c = {_vec3(self.stops[0][1])};"]
        for (v0, c0), (v1, c1) in zip(self.stops, self.stops[1:], strict=False):
            part = f"clamp((v - {_float(v0)}) / {_float(v1 - v0)}, 0.0, 1.0)" if v1 > v0 else "1.0"
            lines.append(f"if (v >= {_float(v0)}) c = mix({_vec3(c0)}, {_vec3(c1)}, {part});")
        lines.append("rgb = vec3(SrgbToLinear(c.x), SrgbToLinear(c.y), SrgbToLinear(c.z));")
        lines.append("if (bad) rgb = vec3(1.0, 0.0, 1.0);")
        return "\n".join(lines)


def diverging(limit: float, caption: str, percent: bool = False) -> Scale:
    """Signed values about 0: blue where the image is too dark, red where it is too bright."""
    stops = tuple((limit * v, c) for v, c in _DIVERGING)
    ticks = tuple((limit * t, _signed(limit * t, percent)) for t in (-1, 0, 1))
    return Scale(stops, ticks, caption)


def standard_errors() -> Scale:
    """|z|: grey below 2, where noise decides, then ever darker red."""
    grey = ((0.0, (150, 153, 156)), (2.0, (150, 153, 156)))
    ticks = ((0.0, "0"), (2.0, "2"), (5.0, "5"), (10.0, "10"), (20.0, "≥ 20"))
    return Scale(grey + _Z, ticks, "|error| in standard errors; grey: noise decides (below 2)")


def flip() -> Scale:
    """FLIP, always from 0 to 1 so that cells compare."""
    stops = tuple((i / 8, c) for i, c in enumerate(_MAGMA))
    return Scale(stops, tuple((v, f"{v:g}") for v in (0.0, 0.25, 0.5, 0.75, 1.0)), "perceived difference, 0 … 1")


def samples(logarithm: NDArray) -> Scale:
    """Samples of a pixel, by their logarithm to the base 2: from the fewest to the most."""
    low, high = math.floor(logarithm.min()), math.ceil(logarithm.max())
    high = max(high, low + 1)
    stops = tuple((low + (high - low) * i / 8, code) for i, code in enumerate(_MAGMA))
    return Scale(stops, tuple((float(v), f"{2**v}") for v in (low, (low + high) // 2, high)), "samples a pixel, logarithmic")


def radiance(exposure: float) -> Scale:
    """Tone-mapped pictures: the radiance that each grey stands for (clamp and sRGB after the exposure)."""
    stops = tuple((i / 8, (round(255 * i / 8),) * 3) for i in range(9))  # even in sRGB code
    ticks = []
    for code in (0.0, 0.5, 1.0):
        linear = code / 12.92 if code <= 0.04045 else ((code + 0.055) / 1.055) ** 2.4
        ticks.append((code, ("≥ " if code == 1 else "") + short(linear / exposure)))
    return Scale(stops, tuple(ticks), f"radiance; exposure {math.log2(exposure):+.2f} EV, sRGB")


def false_colour() -> Scale:
    """Luminance in false colour, logarithmic: stops above (below) what is shown as white, EV."""
    low, high = -8.0, 4.0
    stops = tuple((low + (high - low) * at, code) for at, code in flip().stops)
    return Scale(stops, tuple((v, "") for v in (-8.0, -4.0, 0.0, 4.0)), "luminance, logarithmic")


def regions(names: Iterable[str]) -> Scale:
    """Regions of a cell by their numbers (`compare.regions.ORDER`), one flat colour each."""
    stops = [(float(number) + end, code) for number, code in enumerate(REGIONS) for end in (-0.5, 0.5)]
    shown = [f"{number} {name}" for number, name in enumerate(ORDER, 1) if name in names]
    middle = [(float(number), str(number)) for number, name in enumerate(ORDER, 1) if name in names]
    ticks = ((stops[0][0], ""), *middle, (stops[-1][0], ""))  # the page sets the outermost flush with the bar's ends
    return Scale(tuple(stops), ticks, "; ".join([*shown, f"{OUTLINE} outline of the largest blob"]))


def nice_limit(values: NDArray, least: float) -> float:
    """A round number (1, 2 or 5 × 10ⁿ) near the 99th percentile of |values|: the ends of a diverging scale."""
    top = float(np.percentile(np.abs(values), 99)) if values.size else 0.0
    top = max(top, least, 1e-12)
    power = 10.0 ** math.floor(math.log10(top))
    return float(next(m for m in (1, 2, 5, 10) if m * power >= top * 0.999) * power)


def short(value: float) -> str:
    """Three digits, no trailing zeros, no exponent where avoidable."""
    if value == 0:
        return "0"
    if 999.5 <= abs(value) < 1e4:
        return f"{value:.0f}"
    return f"{value:.3g}" if 1e-3 <= abs(value) < 1e4 else f"{value:.1e}"


def _signed(value: float, percent: bool) -> str:
    text = short(abs(100 * value) if percent else abs(value)) + (" %" if percent else "")
    return text if value == 0 else f"{'+' if value > 0 else '−'}{text}"


def _float(value: float) -> str:
    return f"float({value:.9g})"


def _vec3(code: tuple[int, int, int]) -> str:
    return "vec3(" + ", ".join(f"{c / 255:.5f}" for c in code) + ")"
