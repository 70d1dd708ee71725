"""What a notebook shows of the Python interface's results: HTML that needs nothing but itself, in dark and light."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping
from html import escape

import imageio.v3 as iio
import numpy as np
from numpy.typing import NDArray

from evalsuite.compare import Comparison
from evalsuite.image.color import luminance, tone_map
from evalsuite.report import scales
from evalsuite.report.numbers import interval, number
from evalsuite.report.scales import Scale

#: Metrics shown: (name, words, unit).
METRICS = (
    ("rel_rmse", "relative RMSE", "%"), ("rel_bias", "relative bias", "%"), ("relmse", "relative MSE", ""), ("flip", "FLIP", ""),
    ("ssim", "SSIM", ""), ("psnr", "PSNR", "dB"),
)  # fmt: skip
#: Largest edge of a picture [pixels]; larger ones are thinned.
EDGE = 256
# Colours that stand on white and on black alike; the text has the notebook's own.
_LINE = "1px solid rgba(128, 128, 128, .35)"
_SMALL = "font-size: .85em; opacity: .75"


def comparison(result: Comparison) -> str:
    """Metrics with their intervals beside the signed difference and its scale."""
    values = result.difference.mean(axis=2)
    scale = scales.diverging(scales.nice_limit(values, 0.0), "image − reference, radiance; blue: too dark, red: too bright")
    rows = [
        f"<tr>{_cell(words, 'left')}{_cell(number(metric['value'], unit))}{_cell(interval(metric, unit))}</tr>"
        for name, words, unit in METRICS
        for metric in (result.metrics[name].to_json(),)
    ]
    head = f"<tr>{_cell('', 'left')}{_cell(f'{result.pixels} pixels')}{_cell('95 %')}</tr>"
    notes = "".join(f'<p style="{_SMALL}">{escape(note)}</p>' for note in result.notes)
    table = f'<div><table style="border-collapse: collapse">{head}{"".join(rows)}</table>{notes}</div>'
    return _beside(_figure(scale.colours(values), scale, "Signed difference"), table)


def reference(mean: NDArray, mask: NDArray[np.bool_], spp: int, reached_error: float, capped: bool) -> str:
    """The tone-mapped picture, exposed for the object, and how far it was sampled."""
    light = luminance(mean)[mask] if mask.any() else luminance(mean)
    white = float(np.percentile(light, 99))
    exposure = 1.0 / white if white > 0 else 1.0
    facts = {
        "size": f"{mean.shape[1]} × {mean.shape[0]} pixels, {int(mask.sum())} scored",
        "samples": f"{spp} a pixel{', stopped at the cap' if capped else ''}",
        "relative standard error": number(reached_error, "%"),
    }
    return _beside(_figure(tone_map(mean, exposure), scales.radiance(exposure), "Reference"), scene(facts, "<br>"))


def scene(facts: Mapping[str, str], between: str = " · ") -> str:
    """Facts in a line or two."""
    return "<div>" + between.join(f"<b>{escape(name)}</b> {escape(value)}" for name, value in facts.items()) + "</div>"


def _figure(encoded: NDArray, scale: Scale, title: str) -> str:
    """encoded: (H, W, 3) sRGB in [0, 1]."""
    step = max(1, -(-max(encoded.shape[:2]) // EDGE))
    codes = np.round(np.clip(encoded[::step, ::step], 0, 1) * 255).astype(np.uint8)
    png = io.BytesIO()
    iio.imwrite(png, codes, extension=".png")
    data, width = base64.b64encode(png.getvalue()).decode(), max(codes.shape[1], 192)
    ticks = "".join(
        f'<span style="text-align: {side}">{escape(label)}</span>'
        for (_, label), side in zip((scale.ticks[0], scale.ticks[len(scale.ticks) // 2], scale.ticks[-1]), _SIDES, strict=True)
    )
    return (
        f'<div style="width: {width}px"><img alt="{escape(title)}: {escape(scale.caption)}" width="{width}" '
        f'style="display: block; image-rendering: pixelated" src="data:image/png;base64,{data}">'
        f'<div style="height: 8px; margin-top: 4px; background: {scale.css}"></div>'
        f'<div style="display: grid; grid-template-columns: repeat(3, 1fr); {_SMALL}">{ticks}</div>'
        f'<div style="{_SMALL}">{escape(scale.caption)}</div></div>'
    )


_SIDES = ("left", "center", "right")


def _cell(text: str, side: str = "right") -> str:
    return f'<td style="padding: 2px 8px; text-align: {side}; border-bottom: {_LINE}">{escape(text)}</td>'


def _beside(*parts: str) -> str:
    return f'<div style="display: flex; flex-wrap: wrap; gap: 20px; align-items: flex-start">{"".join(parts)}</div>'
