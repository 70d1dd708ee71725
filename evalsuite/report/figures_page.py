"""The page `index.html` of a folder of figures: each with its title, its paper, what stands in for what, and its files."""

from __future__ import annotations

from pathlib import Path

from evalsuite.report import page
from evalsuite.report.figures import FIGURES
from evalsuite.store.json_file import read_json


def write(directory: Path) -> Path:
    """Write the page of all figures that lie in the folder; returns index.html. Raises EvalsuiteError if it cannot be written."""
    shown = []
    for figure in FIGURES.values():
        try:
            numbers = read_json(directory / f"{figure.id}.json")
        except (OSError, ValueError):  # not made here, or damaged: made anew it is shown
            continue
        if not isinstance(numbers, dict) or not (directory / f"{figure.id}.png").is_file():
            continue
        files = [f"{figure.id}.{kind}" for kind in ("png", "pdf", "html", "json")] + [f"latex/{figure.id}/{figure.id}.tex"]
        files = [(name.rpartition(".")[2].upper(), name) for name in files if (directory / name).is_file()]
        stand_ins = numbers.get("stand_ins")
        shown.append({"figure": figure, "files": files, "stand_ins": stand_ins if isinstance(stand_ins, dict) else {}})
    page.write_static(directory / "static")
    html = (
        page.templates().get_template("figures.html").render(figures=shown, cells=(directory / "cells" / "index.html").is_file())
    )
    page.put(directory / "index.html", html)
    return directory / "index.html"
