"""Two runs side by side: the page `index.html` of a comparison, and its table for the terminal."""

from __future__ import annotations

import importlib.resources
import re
import shutil
from collections.abc import Mapping
from pathlib import Path

import jinja2
from rich.table import Table
from rich.text import Text

from evalsuite.compare.run_folder import Run
from evalsuite.image.files import replacing
from evalsuite.report import run_pictures
from evalsuite.report.numbers import estimate, interval, number
from evalsuite.store.results import slug

#: Verdict → (mark, word, how it goes on where there is room), in the order of the page.
VERDICTS = {
    "further": ("✗", "further", " from truth"),
    "closer": ("✓", "closer", " to truth"),
    "undecided": ("≈", "undecided", ""),
    "unchanged": ("=", "unchanged", ""),
    "unscored": ("–", "no score", ""),
}
#: What `reference` says → a note for the reader; "same" needs none.
REFERENCES = {
    "other samples": "the reference has other samples: noise no longer cancels",
    "another truth": "the truth itself changed: each is held against its own",
    "another size": "the pictures have another size: each is held against its own truth",
    "no pixel in common": "no pixel counts in both",
}
METRICS = {"flip": "FLIP", "ssim": "SSIM"}
_STYLES = {"further": "red", "closer": "green", "undecided": "yellow", "unchanged": "dim", "unscored": "dim"}
_STATIC = ("page.css", "runs.css", "runs.js")


def write(comparison: Mapping, a: Run, b: Run, directory: Path) -> Path:
    """Write the page of a comparison of runs a and b into `directory`; returns index.html. Cells whose picture did not change
    have none there. Raises EvalsuiteError for pictures that cannot be read and a folder that cannot be written."""
    directory = Path(directory)
    everywhere = in_all(comparison)
    cells = [
        {
            "data": row,
            "slug": slug(row["id"]),
            "pictures": run_pictures.prepare(row, a, b, directory),
            "notes": [note for note in notes(row) if note not in everywhere],
        }
        for row in ordered(comparison)
    ]
    kept = {cell["slug"] for cell in cells if cell["pictures"]}
    for folder in (directory / "pictures").glob("*"):
        if folder.name not in kept and re.search(r"-[0-9a-f]{8}$", folder.name):  # of an earlier comparison
            shutil.rmtree(folder)
    static = importlib.resources.files("evalsuite.report").joinpath("static")
    for name in _STATIC:
        with replacing(directory / "static" / name) as temporary:
            temporary.write_bytes(static.joinpath(name).read_bytes())
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("evalsuite.report"), autoescape=True, trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    environment.filters |= {"number": number, "interval": interval, "estimate": estimate, "change": change, "signed": signed}
    html = environment.get_template("runs.html").render(
        comparison=comparison, cells=cells, verdicts=VERDICTS, summary=summary(comparison), host=comparison["changes"],
        everywhere=everywhere,
    )  # fmt: skip
    with replacing(directory / "index.html") as temporary:
        temporary.write_text(html, encoding="utf-8")
    return directory / "index.html"


def ordered(comparison: Mapping) -> list[Mapping]:
    """Cells by verdict, each from the largest change of the squared error to the smallest."""
    places = list(VERDICTS)

    def key(row: Mapping) -> tuple[int, float]:
        value = (row["relative"] or {}).get("value")
        return places.index(row["verdict"]), -abs(value or 0.0)

    return sorted(comparison["cells"], key=key)


def summary(comparison: Mapping) -> str:
    """The verdicts in a sentence."""
    counts, total = comparison["counts"], len(comparison["cells"])
    parts = [f"{counts[name]} {word}{rest}" for name, (_, word, rest) in VERDICTS.items() if counts[name]]
    text = f"Of {total} cells in both runs: {', '.join(parts)}." if total else "The runs have no cell in common."
    alone = [f"{len(comparison[f'only_{side}'])} only in {side.upper()}" for side in "ab" if comparison[f"only_{side}"]]
    return f"{text} {', '.join(alone)}." if alone else text


def notes(row: Mapping) -> list[str]:
    """What else is otherwise between the two cells."""
    said = [f"{one['what']}: {_said(one['a'])} → {_said(one['b'])}" for one in row["changes"]]
    opposite = [f"{METRICS[name]} says the opposite: {_values(row['metrics'][name])}" for name in row["disagree"]]
    return [*filter(None, [REFERENCES.get(row["reference"])]), *opposite, *said]


def in_all(comparison: Mapping) -> list[str]:
    """Notes that all of several cells have, which are said once."""
    first, *others = [notes(row) for row in comparison["cells"]] or [[]]
    return [note for note in first if others and all(note in other for other in others)]


def signed(value: float | None) -> str:
    """A change in per cent, with its sign."""
    return "+" * (value is not None and value > 0) + number(value, "%")


def change(row: Mapping) -> str:
    """The change of the squared error over A's, with its interval."""
    if not row["relative"]:
        return "—" if row["difference"] else ""
    value = row["relative"]["value"]
    return "+" * (value is not None and value > 0) + estimate(row["relative"], "%")


def table(comparison: Mapping) -> Table:
    """One row a cell that is not unchanged, for the terminal."""
    shown = Table(box=None, pad_edge=False, header_style="bold")
    shown.add_column("verdict", no_wrap=True)
    shown.add_column("cell", overflow="fold", min_width=16)
    for name in ("rel_rmse A", "rel_rmse B", "squared error"):
        shown.add_column(name, justify="right", no_wrap=True)
    everywhere = in_all(comparison)
    if everywhere:
        shown.caption, shown.caption_justify = Text(f"In all cells: {'; '.join(everywhere)}"), "left"
    for row in ordered(comparison):
        own = [note for note in notes(row) if note not in everywhere]
        if row["verdict"] == "unchanged" and not own:
            continue
        cell = Text(row["id"])
        for note in own:
            cell.append(f"\n{note}", style="dim")
        mark, word, _ = VERDICTS[row["verdict"]]
        errors = [Text(number(m["value"], "%") if m else "") for m in row["metrics"]["rel_rmse"].values()]
        shown.add_row(Text(f"{mark} {word}", style=_STYLES[row["verdict"]]), cell, *errors, Text(change(row)))
    shown.show_header = shown.row_count > 0
    return shown


def _values(sides: Mapping) -> str:
    return " → ".join(number(metric["value"]) for metric in sides.values())


def _said(value: object) -> str:
    return "—" if value in (None, "") else f"{value:.6g}" if isinstance(value, float) else str(value)
