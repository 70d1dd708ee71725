"""Chosen cells of a finished report as one HTML file, with style, scripts, previews and data in it."""

from __future__ import annotations

import base64
import re
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path

import jinja2
from markupsafe import Markup

from evalsuite.errors import EvalsuiteError
from evalsuite.image.files import replacing
from evalsuite.report.serving import TYPES
from evalsuite.store import results as store_results
from evalsuite.store.results import slug

_SCRIPT = re.compile(r'<script defer src="([^"]+)"></script>')
_STYLE = re.compile(r'<link rel="stylesheet" href="([^"]+)">')
_PICTURE = re.compile(r'src="([^":]+)"')
_FILES = re.compile(r'data-files="([^"]*)"')


def write(directory: Path, patterns: Sequence[str], target: Path) -> list[str]:
    """Write the cells whose ids match any of the patterns (`*`, `?`, `[…]`; all without one) as they stand on their pages in
    `directory`, several of them with a list at the start; returns their ids.

    Raises EvalsuiteError where nothing matches, a file of the report is missing, or the target cannot be written."""
    results = store_results.read(Path(directory))
    cells = [c for c in results["cells"] if not patterns or any(c["id"] == one or fnmatchcase(c["id"], one) for one in patterns)]
    if not cells:
        known = ", ".join(cell["id"] for cell in results["cells"][:3])
        raise EvalsuiteError(
            ", ".join(patterns), "no cell of that name", f"ids or globs of ids such as {known}", "quote the globs"
        )
    names, folder = [slug(cell["id"]) for cell in cells], _Cells(Path(directory).resolve())
    pages = {name: folder.text(f"{name}.html") for name in names}
    # A cell without pictures needs a few of the same, in the same order.
    uses = {name: _SCRIPT.findall(page) for name, page in pages.items()}
    scripts = dict.fromkeys(max(uses.values(), key=len))
    styles = {path: None for page in pages.values() for path in _STYLE.findall(page)}
    files = {file: None for page in pages.values() for found in _FILES.findall(page) for file in found.split()}
    if "../static/plots.js" in scripts:
        files["../static/bokeh.min.js"] = None
    environment = jinja2.Environment(loader=jinja2.PackageLoader("evalsuite.report"), autoescape=True)
    html = environment.get_template("single.html").render(
        title=cells[0]["id"] if len(cells) == 1 else results.get("title") or "Cells",
        report=results,
        cells=[(name, cell, Markup(_section(pages, name, folder))) for name, cell in zip(names, cells, strict=True)],
        styles=[Markup(folder.text(path).replace("</style", r"<\/style")) for path in styles],
        scripts={path: _script(folder.text(path)) for path in scripts},
        uses=uses,
        licence=_script(folder.text("../static/flipbook.LICENSE.txt")),
        files={file: _script(folder.text(file)) for file in files},
    )
    with replacing(Path(target)) as temporary:
        temporary.write_text(html, encoding="utf-8")
    return [cell["id"] for cell in cells]


class _Cells:
    """Files of a report by their paths as its cells' pages have them; nothing beyond the report's folder."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def bytes(self, path: str) -> bytes:
        file = (self.root / "cells" / path).resolve()
        try:
            if file.is_relative_to(self.root):
                return file.read_bytes()
            problem = "a path out of the report"
        except OSError as error:
            problem = f"a file that does not read ({error.strerror})"
        raise EvalsuiteError(file, problem, "a complete report", "run `evalsuite run` again")

    def text(self, path: str) -> str:
        return self.bytes(path).decode("utf-8")

    def inline(self, path: str) -> str:
        """As a data: URL."""
        kind = TYPES.get(Path(path).suffix.lower(), "application/octet-stream")
        return f"data:{kind};base64,{base64.b64encode(self.bytes(path)).decode('ascii')}"


def _section(pages: Mapping[str, str], name: str, folder: _Cells) -> str:
    """What a cell's page has in <main>, its pictures inside and its links leading through the chosen cells."""
    page, order = pages[name], list(pages)
    section = page[page.index("<main>") + len("<main>") : page.rindex("</main>")]
    at = order.index(name)
    for rel, other in (("prev", at - 1), ("next", at + 1)):
        link = f'<a rel="{rel}" href="?cell={order[other]}">' if 0 <= other < len(order) else f'<a rel="{rel}" hidden>'
        section = re.sub(rf'<a rel="{rel}"[^>]*>', lambda _, link=link: link, section, count=1)
    section = section.replace('href="../index.html"', 'href="?"' if len(order) > 1 else 'href="?" hidden', 1)
    return _PICTURE.sub(lambda found: f'src="{folder.inline(found[1])}"', section)


def _script(text: str) -> Markup:
    """A script as it may stand in <script>: nothing in it ends or nests that element. In a string both mean the same."""
    return Markup(re.sub(r"<(/script|!--|script)", lambda found: rf"\x3C{found[1]}", text, flags=re.IGNORECASE))
