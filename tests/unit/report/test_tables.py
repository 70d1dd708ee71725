"""results.csv, results.md and results.tex: what Python's csv, a Markdown parser and LaTeX's grammar make of them."""

from __future__ import annotations

import csv
import io
import re

import pytest
from markdown_it import MarkdownIt

from evalsuite.report import tables
from evalsuite.report.numbers import estimate

NASTY = '<script>alert(1)</script> | a_b *c* `d` [x](http://e.f) #1 @g $h$ & "q" \\ ~i~ ^ % {j} www.k.l'


def cell(scene: str = "torus", **other: object) -> dict:
    return {
        "id": f"{scene}/glossy-boxmip/exponent=10/direct",
        "scene": scene,
        "environment": "office",
        "technique": "glossy-boxmip",
        "parameters": {"env": "office", "exponent": 10.0},
        "target": "direct",
        "status": "scored",
        "message": "",
        "decided": True,
        "metrics": {
            "rel_rmse": {"value": 0.0231, "ci95": [0.022, 0.0242]},
            "rel_bias": {"value": -0.2, "ci95": [-0.21, -0.19]},
            "psnr": {"value": 40.0, "ci95": [39.0, None]},
        },
        "cost": {"gpu_ms": 12.5, "cached": False},
    } | other


def read(text: str) -> list[dict]:
    return list(csv.DictReader(io.StringIO(text, newline="")))


def test_csv_has_every_number_with_both_ends():
    other = cell(parameters={"gain": 2, "specular_reflectance": [1.0, 0.5, 0.25]}, decided=None, metrics={}, status="failed")
    rows = read(tables.to_csv({"cells": [cell(), other]}))
    first, second = rows
    assert [float(first[f"rel_rmse{end}"]) for end in ("", ".low", ".high")] == [0.0231, 0.022, 0.0242]
    assert first["psnr"] == "40.0" and first["psnr.high"] == "", "null is empty"
    assert (first["parameters.exponent"], first["parameters.gain"], first["decided"]) == ("10.0", "", "true")
    assert (second["parameters.gain"], second["parameters.specular_reflectance"]) == ("2", "1.0 0.5 0.25")
    assert second["rel_rmse"] == second["decided"] == second["cost.gpu_ms"] * 0 == ""
    assert first["cost.gpu_ms"] == "12.5" and first["cost.cached"] == "false"


def test_csv_is_rfc_4180():
    text = tables.to_csv({"cells": [cell('a "quoted", name\nof two lines')]})
    assert text.endswith("\r\n") and '"a ""quoted"", name\nof two lines"' in text
    assert read(text)[0]["scene"] == 'a "quoted", name\nof two lines'
    assert len(text.replace("two lines", "").split("\r\n")) == 3, "a head, a row, the end"


@pytest.mark.parametrize("evil", ["=1+1", "+1", "-1+cmd|' /C calc'!A0", "@SUM(A1)", "\t=1", " =1", "＝1", "x;=1+1", "x\n=1"])
def test_csv_starts_no_formula(evil):
    rows = read(tables.to_csv({"cells": [cell(evil, message=evil, parameters={evil: evil})]}))
    for text in [*rows[0].values(), *rows[0]]:
        for part in re.split(r"[;\t\n]", text):  # a spreadsheet of another country splits there
            number = re.fullmatch(r"-?[\d.]+(e[+-]\d+)?", part)
            assert number or not re.match(r"\s*[=+\-@＝]", part), text
    assert rows[0]["rel_bias"] == "-0.2", "numbers stay numbers"


def test_markdown_says_what_the_names_say():
    results = {"title": NASTY, "cells": [cell(NASTY), cell(decided=False, parameters={"n": "a\nb"})]}
    html = MarkdownIt("gfm-like", {"linkify": False}).enable("table").render(tables.to_markdown(results))
    rows = re.findall(r"<tr>(.*?)</tr>", html, re.S)
    assert len(rows) == 3 and all(row.count("<t") == 11 for row in rows)
    texts = [unescaped(t) for t in re.findall(r"<td[^>]*>(.*?)</td>", rows[1])]
    assert texts[0] == NASTY and unescaped(re.search("<h1>(.*)</h1>", html)[1]) == NASTY
    assert texts[6] == "2.31 [2.20, 2.42] %"
    assert "≈ 2.31 [2.20, 2.42] %" in rows[2] and "n a b" in rows[2]
    assert not re.search("<(a|script|em|code|s)[ >]", html)


def unescaped(html: str) -> str:
    import html as library

    assert "<" not in html, "no mark-up of its own"
    return library.unescape(html)


def test_latex_has_one_ampersand_less_than_columns_and_balances():
    scenes = [NASTY, "[optional", "*starred", "café α 中"]
    text = tables.to_latex({"cells": [cell(name) for name in scenes]})
    body = text[text.index("\\begin") :]
    rows = [line for line in body.splitlines() if line.endswith("\\\\")]
    columns = re.search(r"\\begin\{tabular\}\{(\w+)\}", body)[1]
    assert len(rows) == 5 and all(len(re.findall(r"(?<!\\)&", row)) == len(columns) - 1 for row in rows)
    for row in rows:
        bare = re.sub(r"\\[\\{}$&#_%]", "", row)
        assert bare.count("{") == bare.count("}") and bare.count("$") % 2 == 0 and not set('#%^~"<>|') & set(bare)
        assert not re.match(r"\s*[*\[]", row), "that would be an argument of the \\\\ before"
        known = "backslash asciitilde asciicircum less greater bar asciigrave quotesingle tt"
        assert set(re.findall(r"\\([a-zA-Z]+)", row)) <= {"alpha", *(f"text{name}" for name in known.split())}
    assert r"2.31 [2.20, 2.42] \% & $-$20.0 [$-$21.0, $-$19.0] \%" in rows[2]
    assert r"café $\alpha$ \texttt{U+4E2D}" in rows[4]
    assert "\\usepackage" not in text and body.count("\\hline") == 3 and body.rstrip().endswith("\\end{tabular}")


def test_files_lie_beside_and_are_whole(tmp_path):
    tables.write({"cells": [cell("é")]}, tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["results.csv", "results.md", "results.tex"]
    assert read((tmp_path / "results.csv").read_bytes().decode())[0]["scene"] == "é"
    tables.write({"cells": []}, tmp_path)
    assert read((tmp_path / "results.csv").read_text()) == []


@pytest.mark.parametrize(("metric", "unit", "text"), [
    ({"value": 0.0231, "ci95": [0.022, 0.0242]}, "%", "2.31 [2.20, 2.42] %"),
    ({"value": -0.002, "ci95": [-0.0021, -0.0019]}, "%", "−0.200 [−0.210, −0.190] %"),
    ({"value": 40.0, "ci95": [39.0, None]}, "", "40.0 [39.0, ∞]"),
    ({"value": 0.5, "ci95": [0.5, 0.5]}, "", "0.500"),
    ({"value": None, "ci95": [None, None]}, "%", "— [−∞, ∞] %"),
    (None, "%", ""),
])  # fmt: skip
def test_estimate(metric, unit, text):
    assert estimate(metric, unit) == text
