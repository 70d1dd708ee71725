"""What reads files that others write, each with good files to damage."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import damage
import numpy as np

from evalsuite.image import exr

for folder in ("unit/report", "unit/gate", "system"):
    sys.path.insert(0, str(Path(__file__).resolve().parents[1] / folder))

SHAPE = (12, 24, 3)


@dataclass(frozen=True)
class Reader:
    """file: name of the damaged file in the working folder. corpus: good files. read: raises EvalsuiteError for bad ones."""

    file: str
    corpus: Sequence[bytes]
    mutator: damage.Mutator
    read: Callable[[Path], object]


def _noise(*shape: int) -> np.ndarray:
    return np.random.default_rng(2).uniform(0.05, 2.0, shape or SHAPE).astype(np.float32)


def exr_files(folder: Path) -> list[bytes]:
    """Of every compression, one and several parts, one channel, half floats, tiles, a layer."""
    import OpenEXR

    made = []
    for kind in ("ZIP", "PXR24", "HALF"):
        exr.write(folder / "a.exr", {"image": _noise(), "mask": _noise(12, 24)}, {"evalsuite_spp": 64}, compression=kind)
        made.append((folder / "a.exr").read_bytes())
    kinds = ("NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "B44", "B44A", "DWAA", "DWAB")
    for kind in kinds:
        for half, storage in ((True, "scanlineimage"), (False, "tiledimage")):
            header = {"compression": getattr(OpenEXR, f"{kind}_COMPRESSION"), "type": getattr(OpenEXR, storage)}
            if storage == "tiledimage":
                header["tiles"] = OpenEXR.TileDescription()
            pixels = _noise().astype(np.float16 if half else np.float32)
            with contextlib.suppress(Exception), OpenEXR.File(header, {"RGB": pixels}) as file:
                file.write(str(folder / "a.exr"))
                made.append((folder / "a.exr").read_bytes())
    with OpenEXR.File({}, {"view.R": _noise(12, 24), "view.G": _noise(12, 24), "view.B": _noise(12, 24)}) as file:
        file.write(str(folder / "a.exr"))
    made.append((folder / "a.exr").read_bytes())
    (folder / "a.exr").unlink()
    return made


def hdr_files(folder: Path) -> list[bytes]:
    """Flat and run-length coded."""
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=1\n\n-Y 12 +X 24\n"
    rng = np.random.default_rng(1)
    flat = rng.integers(3, 250, (12, 24, 4), dtype=np.uint8)
    runs = np.repeat(flat[:, ::6], 6, axis=1)
    coded = bytearray()
    for row in runs:
        coded += bytes((2, 2, 0, 24))
        for lane in row.T:
            for at in range(0, 24, 6):
                coded += bytes((128 + 6, lane[at]))
    mi.Bitmap(_noise()).write(str(folder / "m.hdr"))
    return [head + flat.tobytes(), head + bytes(coded), (folder / "m.hdr").read_bytes()]


def ldr_files(suffix: str) -> list[bytes]:
    import imageio.v3 as iio

    codes = np.random.default_rng(3).integers(0, 256, SHAPE, dtype=np.uint8)
    if suffix == ".jpg":
        return [iio.imwrite("<bytes>", codes, extension=".jpg"), iio.imwrite("<bytes>", codes[..., 0], extension=".jpg")]
    wide = (codes.astype(np.uint16) * 257)[..., 0]
    return [
        iio.imwrite("<bytes>", codes, extension=".png"),
        iio.imwrite("<bytes>", wide, extension=".png"),
        iio.imwrite("<bytes>", codes[..., 0], extension=".png"),
        iio.imwrite("<bytes>", np.dstack([codes, codes[..., :1]]), extension=".png"),
    ]


def _picture(path: Path) -> None:
    exr.read(path)
    if path.suffix == ".exr":
        exr.read_header(path)
        exr.significant_bits(path)


def _environment(path: Path) -> None:
    from evalsuite.scene.environment import read_environment

    read_environment(path, repair=True)


def exr_picture(folder: Path) -> Reader:
    return Reader("damaged.exr", exr_files(folder), damage.data, _picture)


def exr_environment(folder: Path) -> Reader:
    return Reader("damaged.exr", exr_files(folder), damage.data, _environment)


def hdr_picture(folder: Path) -> Reader:
    return Reader("damaged.hdr", hdr_files(folder), damage.data, _picture)


def hdr_environment(folder: Path) -> Reader:
    return Reader("damaged.hdr", hdr_files(folder), damage.data, _environment)


def png_picture(folder: Path) -> Reader:
    return Reader("damaged.png", ldr_files(".png"), damage.data, _picture)


def jpg_picture(folder: Path) -> Reader:
    return Reader("damaged.jpg", ldr_files(".jpg"), damage.data, _picture)


def _load(xml: Path) -> None:
    """As a run does: names and parameters first, then Mitsuba."""
    from evalsuite.plan import Choice, load_report, plan
    from evalsuite.reference import variants
    from evalsuite.scene import load
    from evalsuite.scene.dependencies import dependencies
    from evalsuite.scene.model import SceneSource

    dependencies(xml)
    plan(load_report("accuracy"), Choice(scenes=(str(xml),), techniques=("diffuse-sh9",)))
    variants.activate()
    load.load(SceneSource(xml)).scene.require_drawable()


def scene(folder: Path) -> Reader:
    from small_scene import scene_xml

    exr.write(folder / "map.exr", _noise())
    _meshes(folder)
    bitmap = '<texture type="bitmap" name="reflectance"><string name="filename" value="map.exr"/></texture>'
    files = [
        scene_xml(),
        scene_xml('<emitter type="envmap"><string name="filename" value="map.exr"/><float name="scale" value="2"/></emitter>'),
        scene_xml(plugin="roughconductor", parameters='<float name="alpha" value="0.2"/><string name="material" value="Au"/>'),
        scene_xml(shape="ply", shape_parameters='<string name="filename" value="a.ply"/>', parameters=bitmap),
        scene_xml(
            shape="obj",
            shape_parameters='<string name="filename" value="a.obj"/>',
            extra='<default name="turn" value="3"/><shape type="cube"><transform name="to_world">'
            '<rotate y="1" angle="$turn"/></transform><bsdf type="twosided"><bsdf type="phong">'
            '<float name="exponent" value="20"/></bsdf></bsdf></shape>',
        ),
    ]
    return Reader("damaged.xml", [file.encode() for file in files], damage.xml_tree, _load)


def _meshes(folder: Path) -> dict[str, list[bytes]]:
    """A tetrahedron as text and binary .ply, .obj and .serialized."""
    import struct
    import zlib

    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    head = (
        "ply\nformat {}\ncomment x\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        "property float nx\nproperty float ny\nproperty float nz\nproperty float u\nproperty float v\n"
        "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    )
    words = "".join(f"{x} {y} {z} 0 0 1 {x} {y}\n" for x, y, z in points) + "".join("3 {} {} {}\n".format(*f) for f in faces)
    ascii_ply = (head.format("ascii 1.0") + words).encode()
    binaries = []
    for name, order in (("binary_little_endian 1.0", "<"), ("binary_big_endian 1.0", ">")):
        body = b"".join(struct.pack(order + "8f", *p, 0, 0, 1, p[0], p[1]) for p in points)
        binaries.append(head.format(name).encode() + body + b"".join(struct.pack(order + "B3i", 3, *f) for f in faces))
    obj = "".join("v {} {} {}\n".format(*p) for p in points) + "vt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\n"
    obj += "".join("f {}/1/1 {}/2/1 {}/3/1\n".format(*(i + 1 for i in f)) for f in faces)
    quads = obj + "f 1 2 3 4\nf -1//-1 -2//-1 -3//-1\n"
    mesh = struct.pack("<I", 0x1001) + b"a\0" + struct.pack("<QQ", 4, 4)
    mesh += b"".join(struct.pack("<3f", *p) for p in points) + b"".join(struct.pack("<3f", 0, 0, 1) for _ in points)
    mesh += b"".join(struct.pack("<3I", *f) for f in faces)
    packed = struct.pack("<HH", 0x041C, 4) + zlib.compress(mesh)
    serialized = packed + struct.pack("<QI", 0, 1)
    found = {"ply": [ascii_ply, *binaries], "obj": [obj.encode(), quads.encode()], "serialized": [serialized]}
    for kind, files in found.items():
        (folder / f"a.{kind}").write_bytes(files[0])
    return found


def _mesh(kind: str, mutator: damage.Mutator) -> Callable[[Path], Reader]:
    def reader(folder: Path) -> Reader:
        from small_scene import scene_xml

        name = f"damaged.{kind}"
        named = f'<string name="filename" value="{name}"/>'
        xml = folder / "scene.xml"
        xml.write_text(scene_xml(shape=kind, shape_parameters=named))
        files = _meshes(folder)[kind]
        return Reader(name, files, mutator, lambda path: _load(xml))

    return reader


def _ply(chance, good: bytes, corpus) -> bytes:
    return (damage.text if chance.random() < 0.4 and good.startswith(b"ply\nformat ascii") else damage.data)(chance, good, corpus)


def _texture(suffix: str, files: Callable[[Path], list[bytes]]) -> Callable[[Path], Reader]:
    """A bitmap that a scene names, which Mitsuba reads itself."""

    def reader(folder: Path) -> Reader:
        from small_scene import scene_xml

        named = f'<string name="filename" value="damaged{suffix}"/>'
        xml = folder / "scene.xml"
        xml.write_text(scene_xml(parameters=f'<texture type="bitmap" name="reflectance">{named}</texture>'))
        return Reader(f"damaged{suffix}", files(folder), damage.data, lambda path: _load(xml))

    return reader


def report(folder: Path) -> Reader:
    from evalsuite.plan import load_report, plan
    from evalsuite.scene.builtin import reports_directory

    files = [path.read_bytes() for path in sorted(reports_directory().glob("*.toml"))]
    small = b"""title = "t"\nsize = [64, 48]\n[[group]]\nname = "a"\nscenes = ["torus", "sphere"]\ntechniques = ["glossy-*"]
environments = ["office"]\ntargets = ["direct"]\nheadroom = true\nparameters = { exponent = [10, 20], lod_offset = 0.5 }\n"""
    return Reader("damaged.toml", [small, small, *files], damage.toml_tree, lambda path: plan(load_report(str(path))))


SHADER = b"""uniform float gain = 1.0; // how much
uniform vec3 tint = vec3(1.0, 0.5, 0.25);
uniform bool half_ = false;
uniform int steps = 3; // loops
vec3 shade(Surface s) {
    vec3 sum = vec3(0.0);
    for (int i = 0; i < steps; i++) sum += gain * tint * max(dot(s.normal, vec3(0.0, 1.0, 0.0)), 0.0);
    return irradiance(s.normal) * sum;
}
"""


def shader(folder: Path) -> Reader:
    from evalsuite.gpu import registry

    return Reader("damaged.glsl", [SHADER], damage.text, lambda path: registry.find(str(path)))


def drawn_shader(folder: Path) -> Reader:
    """The same through the compiler and over a small picture."""
    from small_scene import scene_xml

    from evalsuite.gpu import registry, worker
    from evalsuite.reference import variants
    from evalsuite.scene import load
    from evalsuite.scene.model import SceneSource

    (folder / "scene.xml").write_text(scene_xml())
    variants.activate()
    model = load.load(SceneSource(folder / "scene.xml", size=(12, 10))).scene

    def read(path: Path) -> None:
        registry.find(str(path))
        worker.render(model, str(path), {}, supersample=1)

    return Reader("damaged.glsl", [SHADER], damage.shader, read)


def technique(folder: Path) -> Reader:
    from evalsuite.gpu import registry

    (folder / "damaged.glsl").write_bytes(SHADER)
    good = b'title = "t"\npaper = "p"\nequations = "e"\nassumptions = ["a", "b"]\nbsdf = "phong"\ntarget = "direct"\n'
    return Reader("damaged.toml", [good], damage.toml_tree, lambda path: registry.find(str(path.with_suffix(".glsl"))))


def results(folder: Path) -> Reader:
    """results.json as `compare A B`, `check --no-run`, `bless`, `export` and `run --missing-only` read it."""
    import shutil

    import two_runs

    from evalsuite.commands_gate import bless
    from evalsuite.commands_runs import compare_folders
    from evalsuite.compare.run_folder import Run
    from evalsuite.gate import baseline as baselines
    from evalsuite.gate.verdict import judge
    from evalsuite.report import page, single
    from evalsuite.store import results as store_results

    a, b = two_runs.pair(folder)
    bless(folder / "x.baseline.json", a, [], reason="r")
    page.write(json.loads((b / "results.json").read_text()), b)
    good = (b / "results.json").read_bytes()
    shutil.copytree(b, folder / "damaged")

    def read(path: Path) -> None:
        from evalsuite.errors import EvalsuiteError

        steps = (
            lambda: compare_folders(a, path.parent, folder / "compared"),
            lambda: judge(Run(path.parent, store_results.read(path.parent)), baselines.read(folder / "x.baseline.json"), True),
            lambda: bless(folder / "y.baseline.json", path.parent, [], reason="r"),
            lambda: single.write(path.parent, [], folder / "one.html"),
        )
        problems = []
        for step in steps:
            try:
                step()
            except EvalsuiteError as error:
                problems.append(error)
        if problems:
            raise problems[0]

    return Reader("damaged/results.json", [good], damage.json_tree, read)


def baseline(folder: Path) -> Reader:
    import two_runs

    from evalsuite.commands_gate import bless
    from evalsuite.compare.run_folder import Run
    from evalsuite.gate import baseline as baselines
    from evalsuite.gate import outlets
    from evalsuite.gate.verdict import judge
    from evalsuite.plan import choice_from_json
    from evalsuite.store import results as store_results

    a, b = two_runs.pair(folder)
    bless(folder / "damaged.baseline.json", a, [], reason="r")
    run = Run(b, store_results.read(b))

    def read(path: Path) -> None:
        found = baselines.read(path)
        choice_from_json(found.run.get("choice") or {})
        rows = judge(run, found, True)
        outlets.worst({"cells": rows})
        found.text()

    return Reader("damaged.baseline.json", [(folder / "damaged.baseline.json").read_bytes()], damage.json_tree, read)


def history(folder: Path) -> Reader:
    """Written to, then read for the trends."""
    from evalsuite.gate import history as trend
    from evalsuite.gate.trends import trends

    check = {"created": "2025-01-01", "report": "r", "host": {}, "passed": True, "exit_code": 0,
             "cells": [{"id": "a", "verdict": "same", "picture_change": 0.1,
                        "metrics": {"rel_rmse": {"now": {"value": 0.1, "ci95": [0.0, 0.2]}}}}]}  # fmt: skip
    for _ in range(3):
        trend.append(folder / "good.sqlite", check, None)

    def use(path: Path) -> None:
        trend.append(path, check, "c")
        json.dumps(trends("r", trend.read(path, "r", 500)), allow_nan=False)

    return Reader("damaged.sqlite", [(folder / "good.sqlite").read_bytes()], damage.data, use)


def record(folder: Path) -> Reader:
    """A baseline's kept picture."""
    import two_runs

    from evalsuite.gate.record import Record

    mean, sigma = two_runs.reference(1)
    Record.of(two_runs.picture(0.1), two_runs.mask(), None, mean, sigma).write(folder / "good.exr")
    return Reader("damaged.exr", [(folder / "good.exr").read_bytes()], damage.data, lambda path: Record.read(path).digest)


def fault(folder: Path) -> Reader:
    """Fails at seed 1 in the way that $FUZZ_FAULT says, for the test of the harness itself."""
    import os
    import time

    from evalsuite.errors import EvalsuiteError

    class TwoLines(EvalsuiteError):
        def __str__(self) -> str:
            return "one\ntwo"

    def lines() -> None:
        raise TwoLines("a", "b", "c")

    faults = {"crash": os.abort, "hang": lambda: time.sleep(30), "memory": lambda: bytearray(1 << 30).find(b"x"),
              "exception": lambda: 1 // 0, "lines": lines}  # fmt: skip

    def draw(chance, good: bytes, corpus) -> bytes:
        return chance.randbytes(8)

    chosen = damage.mutated(draw, 1, [b""])
    return Reader("damaged", [b""], draw, lambda path: path.read_bytes() == chosen and faults[os.environ["FUZZ_FAULT"]]())


def figures_lock(folder: Path) -> Reader:
    from evalsuite.report.figures import lock
    from evalsuite.scene.builtin import reports_directory

    whole = json.loads((reports_directory() / "figures" / lock.NAME).read_text("utf-8"))
    some = {name: whole["figures"][name] for name in ("000-fig5", "002-fig3")}
    good = json.dumps(whole | {"figures": some}).encode()

    def read(path: Path) -> None:
        for name, locked in lock.read(path)["figures"].items():
            if name in some:
                lock.check(name, locked, some[name])

    return Reader("figures.lock.json", [good], damage.json_tree, read)


READERS: dict[str, Callable[[Path], Reader]] = {
    "exr": exr_picture,
    "exr-environment": exr_environment,
    "hdr": hdr_picture,
    "hdr-environment": hdr_environment,
    "png": png_picture,
    "jpg": jpg_picture,
    "scene": scene,
    "ply": _mesh("ply", _ply),
    "obj": _mesh("obj", damage.text),
    "serialized": _mesh("serialized", damage.data),
    "exr-texture": _texture(".exr", exr_files),
    "hdr-texture": _texture(".hdr", hdr_files),
    "png-texture": _texture(".png", lambda folder: ldr_files(".png")),
    "jpg-texture": _texture(".jpg", lambda folder: ldr_files(".jpg")),
    "report": report,
    "shader": shader,
    "drawn-shader": drawn_shader,
    "technique": technique,
    "results": results,
    "baseline": baseline,
    "figures-lock": figures_lock,
    "record": record,
    "history": history,
}
