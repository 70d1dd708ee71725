"""A run as tables for other programs: `results.csv` with everything, `results.md` and `results.tex` to paste."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from evalsuite.image.files import replacing
from evalsuite.report import latex
from evalsuite.report.numbers import estimate, number

#: Columns of the tables to paste: (metric, head, unit).
SHOWN = (("rel_rmse", "rel. RMSE", "%"), ("rel_bias", "rel. bias", "%"), ("flip", "FLIP", ""), ("ssim", "SSIM", ""))
COSTS = ("gpu_ms", "shadow_ms", "acquire_ms", "prepare_ms", "reference_s", "reference_spp", "cached", "wall_s")
#: What spreadsheets take for a formula at the beginning of a field, or of what they split off.
_FORMULA = re.compile(r"(^|[;\t\r\n])(?=\s*[=+\-@＝＋－＠])")


def write(results: Mapping, directory: Path) -> None:
    """Write the three tables of `results` (as in results.json). Raises EvalsuiteError if the folder cannot be written."""
    for name, text in (("csv", to_csv(results)), ("md", to_markdown(results)), ("tex", to_latex(results))):
        with replacing(Path(directory) / f"results.{name}") as temporary:
            temporary.write_bytes(text.encode())


def to_csv(results: Mapping) -> str:
    """One row a cell, RFC 4180: names, each parameter as `parameters.NAME`, each metric with both ends of its interval as
    `NAME`, `NAME.low`, `NAME.high` in the units of results.json, costs as `cost.NAME`. Null and what a cell lacks are empty.

    A text that a spreadsheet would compute, as it begins with = + - or @, gets an apostrophe in front; numbers do not."""
    cells = results.get("cells", [])
    parameters = list(dict.fromkeys(name for cell in cells for name in cell.get("parameters") or {}))
    metrics = _metrics(cells)
    facts = ("id", "scene", "environment", "technique")
    judged = ("target", "status", "message", "decided", "target_error", "reached_error", "seed", "reference_id")
    heads = [
        *facts, *(f"parameters.{name}" for name in parameters), *judged,
        *(f"{name}{end}" for name in metrics for end in ("", ".low", ".high")), *(f"cost.{name}" for name in COSTS),
    ]  # fmt: skip
    text = io.StringIO()
    table = csv.writer(text)
    table.writerow(map(_field, heads))
    for cell in cells:
        given, scores, cost = (cell.get(key) or {} for key in ("parameters", "metrics", "cost"))
        table.writerow(map(_field, [
            *(cell.get(name) for name in facts), *(given.get(name) for name in parameters), *(cell.get(name) for name in judged),
            *(value for name in metrics for value in _numbers(scores.get(name))), *(cost.get(name) for name in COSTS),
        ]))  # fmt: skip
    return text.getvalue()


def to_markdown(results: Mapping) -> str:
    """GitHub's Markdown; names stay what they are, whatever characters they have."""
    heads, rows, units = _table(results)
    lines = ["| " + " | ".join([*map(_markdown, row[:-units]), *row[-units:]]) + " |" for row in (heads, *rows)]
    rule = "|" + "|".join(["---"] * (len(heads) - units) + ["---:"] * units) + "|"
    title = [f"# {_markdown(str(results['title']))}", ""] if results.get("title") else []
    return "\n".join([*title, lines[0], rule, *lines[1:], "", _markdown(_NOTE), ""])


def to_latex(results: Mapping) -> str:
    """A `tabular` to \\input, which needs no package; characters without a LaTeX name become their code (U+4E2D)."""
    heads, rows, units = _table(results)
    # After \\\\ a star or a bracket would be an argument of it.
    body = ["{}" * row[0].startswith(("*", "[")) + " & ".join(map(_latex, row)) + r" \\" for row in (heads, *rows)]
    columns = "l" * (len(heads) - units) + "r" * units
    return "\n".join([
        f"% {_latex(_NOTE)}", rf"\begin{{tabular}}{{{columns}}}", r"\hline", body[0], r"\hline", *body[1:], r"\hline",
        r"\end{tabular}", "",
    ])  # fmt: skip


_NOTE = (
    "Errors are image − reference over the object; [ ] hold 95 % of what the reference's noise allows; "
    "≈ noise could change the order."
)


def _table(results: Mapping) -> tuple[list[str], list[list[str]], int]:
    """(heads, rows, how many columns at the end are numbers) of the tables to paste, as plain text."""
    heads = ["Scene", "Environment", "Technique", "Parameters", "Target", "Status", *(h for _, h, _ in SHOWN), "GPU ms"]
    rows = []
    for cell in results.get("cells", []):
        metrics, given, status = cell.get("metrics") or {}, cell.get("parameters") or {}, str(cell.get("status", ""))
        words = ", ".join(f"{name} {_short(value)}" for name, value in given.items() if name != "env")
        scores = [estimate(metrics.get(name), unit) for name, _, unit in SHOWN]
        if cell.get("decided") is False:
            scores[0] = f"≈ {scores[0]}"
        named = (cell.get("scene"), cell.get("environment") or given.get("env"), cell.get("technique"))
        cost = (cell.get("cost") or {}).get("gpu_ms")
        rows.append([*map(_text, named), words, _text(cell.get("target")), status, *scores,
                     "" if cost is None else number(cost)])  # fmt: skip
    return heads, rows, len(SHOWN) + 1


def _metrics(cells: Sequence[Mapping]) -> list[str]:
    """Every metric that a cell has, those over the whole picture (`_full`) last."""
    have = dict.fromkeys(name for cell in cells for name in cell.get("metrics") or {})
    return sorted(have, key=lambda name: name.endswith("_full"))


def _numbers(metric: Mapping | None) -> tuple[float | None, ...]:
    return (metric["value"], *metric["ci95"]) if metric else (None, None, None)


def _field(value: object) -> str:
    if isinstance(value, bool | int | float):
        return _text(value)
    return _FORMULA.sub(r"\1'", _text(value))


def _text(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list | tuple):
        return " ".join(map(_text, value))
    return repr(value) if isinstance(value, float) else str(value)


def _short(value: object) -> str:
    if isinstance(value, list | tuple):
        return " ".join(map(_short, value))
    return f"{value:.6g}" if isinstance(value, float) else _text(value)


def _markdown(text: str) -> str:
    plain = " ".join(text.split()).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return re.sub(r"([\\`*_{}\[\]()|~$#!@]|:(?=//)|(?<=www)\.)", r"\\\1", plain)


def _latex(text: str) -> str:
    return latex.escape(" ".join(text.split()))
