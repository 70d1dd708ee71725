"""The page `claims.html`: every statement, what was measured, the verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from evalsuite.report import page
from evalsuite.report.claims.verdict import FAILS, HOLDS, LIMITS, UNTESTED

ORDER = (HOLDS, LIMITS, FAILS, UNTESTED)


def write(claims: Sequence[Mapping], directory: Path) -> Path:
    """Write the page of claims, each as in claims.json; returns claims.html. Raises EvalsuiteError if the folder cannot be
    written."""
    counts = {verdict: sum(one["verdict"] == verdict for one in claims) for verdict in ORDER}
    page.write_static(directory / "static")
    figures = {one["figure"]: _near(directory, one["figure"]) for one in claims if one["figure"]}
    html = page.templates().get_template("claims.html").render(claims=claims, counts=counts, order=ORDER, figures=figures)
    page.put(directory / "claims.html", html)
    return directory / "claims.html"


def _near(directory: Path, figure: str) -> str | None:
    """Where the page finds a figure that was drawn before: beside it, or in the folder `figures` beside its own."""
    for place in (directory, directory / ".." / "figures"):
        for kind in ("html", "png"):
            if (place / f"{figure}.{kind}").is_file():
                return (place / f"{figure}.{kind}").relative_to(directory).as_posix()
    return None
