"""The HTML page of a run: `index.html`, a page for each cell in `cells/`, and `static/`; opened from disk with no server and
no network."""

from __future__ import annotations

import importlib.metadata
import importlib.resources
import importlib.util
import os
import re
import shutil
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import jinja2

from evalsuite.image.files import replacing
from evalsuite.report import (
    budgets,
    causes,
    cell_plots,
    envelopes,
    findings,
    matrix,
    pictures,
    plots,
    rankings,
    scales,
    surroundings,
    tables,
    where,
)
from evalsuite.report.numbers import interval, number, plain
from evalsuite.report.scales import short
from evalsuite.store.results import slug

#: Metrics in the order of the page: (name, unit of the table: "" or "%", what it says).
METRICS = (
    ("rel_rmse", "%", "root mean square error over the mean of the reference"),
    ("rel_bias", "%", "mean signed error over the mean of the reference"),
    ("relmse", "", "mean of squared error over squared reference (ε = 1 % of its mean)"),
    ("smape", "%", "mean of |a − b| over the mean of |a| and |b|"),
    ("flip", "", "FLIP of the tone-mapped pictures, 0 … 1"),
    ("flip_hdr", "", "HDR-FLIP: the worst over a range of exposures, 0 … 1"),
    ("ssim", "", "structural similarity of the tone-mapped pictures, 1 is alike"),
    ("delta_e2000", "", "CIEDE2000 colour difference of the tone-mapped pictures"),
    ("psnr", "dB", "peak: the radiance shown as white"),
    ("mse", "", "mean squared error, radiance²"),
    ("rmse", "", "root mean square error, radiance"),
    ("mae", "", "mean absolute error, radiance"),
    ("bias", "", "mean signed error, radiance"),
    ("p99_abs", "", "99th percentile of the largest channel's |error|, radiance"),
    ("max_abs", "", "largest |error| of any channel, radiance"),
)
#: Of a cell's page, with pictures and without.
CELL_SCRIPTS = [f"{name}.js" for name in (
    "flipbook", "visit", "view", "pixels", "digits", "book", "swipe", "exposure", "inspector", "figures", "plots", "histogram",
    "viewer", "cell",
)]  # fmt: skip
PLAIN_SCRIPTS = ["visit.js", "view.js", "cell.js"]
STATUS = {"scored": "scored", "failed": "failed", "skipped": "skipped", "uncertified": "not certified"}


def write(results: Mapping, directory: Path) -> Path:
    """Write the page of `results` (as in results.json) into `directory`, which holds the pictures; returns index.html.

    Data of a cell whose pictures have not changed is left as it is. A picture that cannot be read is named on its cell;
    nothing is raised for it. Raises EvalsuiteError if the folder cannot be written.
    """
    directory = Path(directory)
    cells = []
    wanted = [(cell, slug(cell["id"])) for cell in results.get("cells", [])]
    with ThreadPoolExecutor(os.cpu_count()) as pool:  # compression leaves Python's lock alone
        prepared = list(pool.map(lambda pair: pictures.prepare(*pair, directory), wanted))
    for (cell, name), shown in zip(wanted, prepared, strict=True):
        around = surroundings.section(cell, directory)
        cells.append({"slug": name, **vars(shown), "data": cell, "row": _row(cell), "surroundings": around})
    shared = {Path(c["surroundings"]["preview"]).stem for c in cells if c["surroundings"]}
    shared |= {Path(file).stem for c in cells for file in c["files"]}
    _remove_stale(directory / "cells", {c["slug"] for c in cells}, shared)
    write_static(directory / "static")
    put(directory / "static" / "figures.js", f"const cellFigures = {pictures.js_json(cell_plots.figures())};\n")
    environment = templates()
    shared = {"results": results, "metrics": METRICS, "statuses": STATUS, "region_rows": where.ROWS}
    for before, cell, after in zip([None, *cells], cells, [*cells[1:], None], strict=False):
        own = {"figures": pictures.js_json(cell_plots.contents(cell["data"])), "false_colour": pictures.js_json(_false_colour())}
        words = {"root": "../", "cell": cell, "before": before and before["slug"], "after": after and after["slug"]}
        words |= {"scripts": CELL_SCRIPTS if cell["pictures"] else PLAIN_SCRIPTS, **own}
        put(directory / "cells" / f"{cell['slug']}.html", environment.get_template("cell_page.html").render(**shared, **words))
    across = {
        "causes": causes.section(results),
        "envelopes": envelopes.section(results, directory),
        "rankings": rankings.section(results, directory),
        "findings": findings.findings(results),
        "matrix": matrix.section(results, METRICS),
    }
    across["figures"] = pictures.js_json(_figures(results, across["envelopes"]))
    counts = {status: sum(c["data"].get("status") == status for c in cells) for status in STATUS}
    tables.write(results, directory)
    index = directory / "index.html"
    facts = _host(results.get("host") or {}) + budgets.fact(results)
    across |= {"counts": counts, "host": facts, "trends": (directory / "trends.html").exists()}
    put(index, environment.get_template("index.html").render(**shared, **across, cells=cells))
    return index


def _figures(results: Mapping, swept: Mapping | None) -> dict[str, dict]:
    """The overview's plots by name."""
    figures = plots.points()
    rows = results.get("causes") or []
    ledger = plots.ledger(rows, causes.colours(rows))
    for figure in swept["figures"] if swept else ():
        figures |= figure.plots
    return figures | ({"ledger": ledger} if ledger else {})


def _false_colour() -> dict[str, object]:
    scale = scales.false_colour()
    return {"glsl": scale.glsl, "css": scale.css, "ticks": [(value, scale.position(value)) for value, _ in scale.ticks]}


def templates() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("evalsuite.report"), autoescape=True, trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    environment.filters |= {"number": number, "interval": interval, "plain": plain, "short": _short, "link": _link,
                            "worst_region": where.worst,
                            "curves": cell_plots.curves, "numbered": where.numbered}  # fmt: skip
    return environment


def put(path: Path, html: str) -> None:
    """Write a page, without its lines' indentation, unless it stands there already."""
    text = re.sub(r"\n\s+", "\n", html)
    if not (path.is_file() and path.read_text(encoding="utf-8") == text):
        with replacing(path) as temporary:
            temporary.write_text(text, encoding="utf-8")


def _link(to: str) -> str:
    """Where a finding leads: a section of the page, or a cell by its id."""
    return to if to.startswith("#") else f"cells/{slug(to)}.html"


def _short(value: float | None) -> str:
    return "—" if value is None else short(float(value))


def _row(cell: Mapping) -> dict[str, object]:
    """What the summary table sorts and shows."""
    cost, metrics = cell.get("cost") or {}, cell.get("metrics") or {}
    parameters = cell.get("parameters") or {}
    certificate = cell.get("certificate")
    return {
        "environment": cell.get("environment") or parameters.get("env") or "",
        "parameters": "\n".join(f"{k} = {plain(v)}" for k, v in parameters.items() if k != "env"),
        "gpu_ms": cost.get("gpu_ms"),
        "reference_spp": cost.get("reference_spp"),
        "reference_s": cost.get("reference_s"),
        "cached": cost.get("cached"),
        "certificate": "" if not certificate else "passed" if certificate.get("passed") else "failed",
        **{name: metrics.get(name) for name in ("rel_rmse", "rel_bias", "flip", "ssim")},
    }


def _host(host: Mapping) -> list[tuple[str, str]]:
    names = {"gl_renderer": "GPU side", "mitsuba": "Mitsuba", "variant": "variant", "drjit": "Dr.Jit", "llvm": "LLVM",
             "cpu": "processor", "git": "revision"}  # fmt: skip
    return [(names[key], plain(host[key])) for key in names if host.get(key)]


def write_static(folder: Path) -> None:
    """Our own style and scripts, FlipBook and Bokeh from the installed packages, and their licences beside them."""
    package = Path(importlib.util.find_spec("simpleimageio").submodule_search_locations[0])
    licence = next(f for f in importlib.metadata.files("simpleimageio") or [] if f.name == "LICENSE")
    sources = {"flipbook.js": package / "flipbook.js", "flipbook.LICENSE.txt": Path(licence.locate())}
    bokeh = Path(importlib.util.find_spec("bokeh").submodule_search_locations[0])
    sources |= {"bokeh.min.js": bokeh / "server/static/js/bokeh.min.js", "bokeh.LICENSE.txt": bokeh / "LICENSE.txt"}
    for file in importlib.resources.files("evalsuite.report").joinpath("static").iterdir():
        sources[file.name] = Path(str(file))
    for name, source in sources.items():
        target = folder / name
        if not (target.exists() and target.read_bytes() == source.read_bytes()):
            with replacing(target) as temporary:
                shutil.copyfile(source, temporary)


def _remove_stale(folder: Path, cells: set[str], files: set[str]) -> None:
    """Data, previews and pages of cells that are gone, data of references and pictures of environments that no cell has, and
    previews of other versions."""
    shared = (*folder.glob("references/*.js"), *folder.glob("environments/*.webp"))
    for path in (*folder.glob("*-????????*"), *shared, *folder.glob("*/*.png")):
        if path.parent.name in ("references", "environments"):
            gone = path.stem not in files
        elif path.suffix == ".png":
            gone = path.parent.name in cells
        else:
            name = path.name if path.is_dir() else path.stem
            gone = name not in cells and re.search(r"-[0-9a-f]{8}$", name)
        if gone:
            shutil.rmtree(path) if path.is_dir() else path.unlink()
