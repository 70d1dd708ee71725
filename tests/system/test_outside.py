"""Nothing is written outside the output and cache folders, and nothing outside a report's folder is shown, whatever names say."""

from __future__ import annotations

import json
import os
import random
import shutil
import sys
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pytest
from small_scene import scene_xml

from evalsuite.image import exr

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "unit" / "report"))
import two_runs

#: A hook that appends what a process opens for writing, makes, renames, removes or links to $WRITES; also in its workers.
SITE = """
import os, sys
log = os.open(os.environ["WRITES"], os.O_WRONLY | os.O_APPEND | os.O_CREAT)
def note(*paths, folder=None):
    base = os.readlink(f"/proc/self/fd/{folder}") if isinstance(folder, int) and folder >= 0 else os.getcwd()
    for path in paths:
        if isinstance(path, (str, bytes)) or hasattr(path, "__fspath__"):
            os.write(log, os.fsencode(os.path.abspath(os.path.join(base, os.fsdecode(path)))) + b"\\n")
def hook(event, args):
    if event == "open":
        path, mode, flags = args
        if flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT) or (isinstance(mode, str) and set(mode) & set("wax+")):
            note(path)
    elif event in ("os.remove", "os.rmdir"):
        note(args[0], folder=args[1])
    elif event in ("os.mkdir", "os.rename", "os.link", "os.symlink", "os.truncate", "shutil.rmtree",
                   "sqlite3.connect", "os.chmod"):
        note(*args[:2])
sys.addaudithook(hook)
"""

SHADER = "vec3 shade(Surface s) { return irradiance(s.normal); }\n"
#: Of what the system and the libraries keep for themselves: the interpreter's, Dr.Jit's and Mesa's caches, workers' logs.
SYSTEM = ("/dev/", "/proc/")


def _run(evalsuite, folder: Path, *words: object, **more: str):
    """The command with the hook in it; its outcome and what it wrote outside `o/`, the cache and the system's own places."""
    site = folder / "site"
    site.mkdir(exist_ok=True)
    (site / "sitecustomize.py").write_text(SITE)
    (folder / "tmp").mkdir(exist_ok=True)
    path = os.pathsep.join([str(site), *filter(None, [os.environ.get("PYTHONPATH")])])
    env = {"PYTHONPATH": path, "WRITES": str(folder / "writes"), "TMPDIR": str(folder / "tmp"), "HOME": str(folder / "home"),
           "EVALSUITE_CACHE": str(folder / "cache"), "XDG_CACHE_HOME": str(folder / "home"), "PYTHONDONTWRITEBYTECODE": "1",
           "MPLCONFIGDIR": str(folder / "home")}  # fmt: skip
    work = folder / "work" / "deep"
    outcome = evalsuite(*words, cwd=work, **(env | more))
    allowed = [str(folder / name) + "/" for name in ("cache", "home", "tmp", "writes")] + [f"{work}/o/", *SYSTEM]
    written = {line for line in (folder / "writes").read_text().splitlines()}
    return outcome, {path for path in written if not any((path + "/").startswith(place) for place in allowed)}, written


@pytest.fixture
def place(tmp_path) -> Path:
    """work/deep, where commands are typed, with a scene whose names lead out of it wherever names can."""
    work = tmp_path / "work" / "deep"
    work.mkdir(parents=True)
    exr.write(work / "map.exr", np.random.default_rng(1).uniform(0.2, 1, (8, 16, 3)).astype(np.float32))
    texture = '<texture type="bitmap" name="reflectance"><string name="filename" value="../deep/map.exr"/></texture>'
    xml = scene_xml(
        '<emitter type="envmap" id="../../light"><string name="filename" value="../deep/map.exr"/></emitter>',
        material="../../../clay",
        parameters=texture,
    )
    (work / ".. .. x.xml").write_text(
        xml.replace('width" value="48', 'width" value="24').replace('height" value="40', 'height" value="20')
    )
    (work / "..shade.glsl").write_text(SHADER)
    (work / "..shade.toml").write_text('title = "../../x"\n')
    (work / "..report.toml").write_text(
        'title = "../../../x"\n[[group]]\nname = "../../x"\nscenes = [".. .. x.xml"]\n'
        'techniques = ["diffuse-sh9", "diffuse-map"]\ntargets = ["unoccluded"]\n'
    )
    return tmp_path


def test_names_that_lead_out(evalsuite, place):
    words = ("run", "..report.toml", "--out", "o", "-t", "../deep/..shade.glsl", "--target-error", "0.2")
    outcome, outside, written = _run(evalsuite, place, *words)
    assert outcome.code == 0, outcome.err
    assert not outside
    assert any(path.endswith("results.json") or "/o/" in path for path in written)  # the hook is there


def test_a_report_without_a_name(evalsuite, place):
    work = place / "work" / "deep"
    shutil.copy(work / "..report.toml", work / "...toml")
    outcome, outside, _ = _run(evalsuite, place, "run", "...toml")
    assert outcome.code == 2 and "...toml" in outcome.err and not outside


@pytest.fixture
def runs(tmp_path) -> tuple[Path, Path]:
    return two_runs.pair(tmp_path)


def _edit(run: Path, change) -> None:
    data = json.loads((run / "results.json").read_text())
    change(data["cells"][0])
    (run / "results.json").write_text(json.dumps(data))


@pytest.mark.parametrize("path", ["../../etc/passwd", "/etc/passwd", "images/../../secret.exr", "link/secret.exr"])
def test_pictures_beyond_the_folder(evalsuite, tmp_path, runs, path):
    a, b = runs
    (tmp_path / "elsewhere").mkdir()
    for secret in (tmp_path / "secret.exr", tmp_path / "elsewhere" / "secret.exr"):
        exr.write(secret, two_runs.picture(0.2).astype(np.float32))
    (b / "link").symlink_to(tmp_path / "elsewhere")
    _edit(b, lambda cell: cell["images"].update(image=path))
    for words in (("compare", a, b, "-o", "c"), ("bless", "accuracy", "--out", b, "--baseline", "x.json", "--reason", "r")):
        outcome = evalsuite(*words, cwd=tmp_path)
        assert outcome.code == 2 and outcome.err.count("\n") == 1, outcome.err


def test_names_of_pictures_beyond_the_folder(evalsuite, tmp_path, runs):
    a, b = runs
    _edit(b, lambda cell: cell["images"].update({"../../../x": cell["images"]["image"]}))
    assert evalsuite("compare", a, b, "-o", "c", cwd=tmp_path).code == 2


@pytest.mark.parametrize("name", ["cells", "images", "static", "pictures", "rankings", "envelopes", "history.sqlite"])
def test_links_in_the_output_folder(evalsuite, tmp_path, runs, name):
    victim = tmp_path / "victim"
    (victim / "kept-01234567").mkdir(parents=True)
    (tmp_path / "c").mkdir()
    (tmp_path / "c" / name).symlink_to(victim)
    before = sorted(victim.rglob("*"))
    outcome = evalsuite("compare", *runs, "-o", "c", cwd=tmp_path)
    assert outcome.code == 2 and "link" in outcome.err
    assert sorted(victim.rglob("*")) == before
    (tmp_path / "c" / name).unlink()
    assert evalsuite("compare", *runs, "-o", "c", cwd=tmp_path).code == 0


def test_export_keeps_to_the_folder(tmp_path, runs):
    """A page that was edited to show, or run, what is elsewhere."""
    from evalsuite.errors import EvalsuiteError
    from evalsuite.report import page, single

    _, run = runs
    page.write(json.loads((run / "results.json").read_text()), run)
    (tmp_path / "secret.txt").write_text("secret")
    (run / "cells" / "link.txt").symlink_to(tmp_path / "secret.txt")
    target = next((run / "cells").glob("*.html"))
    good = target.read_text()
    single.write(run, [], tmp_path / "one.html")
    for path in ("../../secret.txt", "link.txt", str(tmp_path / "secret.txt")):
        target.write_text(good.replace("</main>", f'<img src="{path}"></main>'))
        with pytest.raises(EvalsuiteError, match="out of the report"):
            single.write(run, [], tmp_path / "one.html")


def test_serve_keeps_to_the_folder(tmp_path):
    """Thousands of paths of traversals, encoded once and twice, and links: none names a file elsewhere."""
    from evalsuite.report.serving import inside

    root = tmp_path / "report"
    (root / "cells").mkdir(parents=True)
    (root / "index.html").write_text("page")
    (tmp_path / "secret.txt").write_text("secret")
    (root / "cells" / "link.txt").symlink_to(tmp_path / "secret.txt")
    (root / "out").symlink_to(tmp_path)
    words = ["..", ".", "cells", "out", "link.txt", "secret.txt", "index.html", "", "etc", "passwd", "%00", "\\", "~", "report"]
    chance, found = random.Random(4), 0
    for _ in range(5000):
        path = "/".join(chance.choices(words, k=chance.randrange(1, 7)))
        for _ in range(chance.randrange(3)):
            path = quote(path, safe=chance.choice(("/", "", "/.")))
        path = path.replace(".", "%2e") if chance.random() < 0.3 else path
        try:
            file = inside(root.resolve(), path)
        except (OSError, ValueError):
            continue
        found += file is not None
        assert file is None or (file.is_relative_to(root.resolve()) and file.read_text() != "secret"), path
    assert found > 0
