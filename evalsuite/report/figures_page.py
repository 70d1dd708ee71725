"""The page `index.html` of a folder of figures: each with its title, its paper, what stands in for what, and its files."""

from __future__ import annotations

import json
from pathlib import Path

from evalsuite.report import page
from evalsuite.report.figures import FIGURES


def write(directory: Path) -> Path:
    """Write the page of all figures that lie in the folder; returns index.html. Raises EvalsuiteError if it cannot be written."""
    shown = []
    for figure in FIGURES.values():
        numbers = directory / f"{figure.id}.json"
        if not (numbers.is_file() and (directory / f"{figure.id}.png").is_file()):
            continue
        files = [f"{figure.id}.{kind}" for kind in ("png", "pdf", "html", "json")] + [f"latex/{figure.id}/{figure.id}.tex"]
        files = [(name.rpartition(".")[2].upper(), name) for name in files if (directory / name).is_file()]
        shown.append({"figure": figure, "files": files, **json.loads(numbers.read_text("utf-8"))})
    page.write_static(directory / "static")
    html = (
        page.templates().get_template("figures.html").render(figures=shown, cells=(directory / "cells" / "index.html").is_file())
    )
    page.put(directory / "index.html", html)
    return directory / "index.html"
