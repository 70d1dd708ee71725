"""The table over all techniques: means of fractions with their intervals, the worst cell, other orders, undecided cells."""

from __future__ import annotations

import pytest

from evalsuite.compare.causes import causes, sentence
from evalsuite.report import causes as page


def cell(name, technique, fractions, half=0.01, low=1e-6, other=None):
    ledger = [
        {"rung": rung, "fraction": f, "fraction_ci95": [f - half, f + half]}
        | ({"other_order": {"fraction": other}} if other is not None and rung == "kernel" else {})
        for rung, f in fractions.items()
    ]
    return {"id": name, "technique": technique, "ledger": ledger, "ledger_total": 1e-5, "metrics": {"mse": {"ci95": [low, 2e-5]}}}


CELLS = [
    cell("a", "x", {"lobe": 0.7, "kernel": 0.3}, other=0.5),
    cell("b", "x", {"lobe": 0.9, "kernel": 0.1}, half=0.02),
    cell("c", "x", {"lobe": -5.0, "kernel": 6.0}, low=0.0),
    cell("d", "y", {"lobe": -0.2, "kernel": 1.2}),
    cell("e", "z", {"lobe": 1.0}, low=0.0),
    {"id": "f", "technique": "w", "ledger": [], "metrics": {}},
]


def test_shares_are_averaged_over_cells_whose_error_is_beyond_noise():
    x, y, z = causes(CELLS)
    assert (x["technique"], x["cells"], x["undecided"]) == ("x", 2, 1)
    first, second = x["causes"]
    assert first["rung"] == "lobe" and first["fraction"]["value"] == pytest.approx(0.8)
    half = 0.5 * (0.01**2 + 0.02**2) ** 0.5
    assert first["fraction"]["ci95"] == pytest.approx([0.8 - half, 0.8 + half])
    assert first["largest"] == {"cell": "b", "fraction": 0.9} and first["order"] is None
    assert second["order"] == pytest.approx(0.2)
    assert [c["rung"] for c in y["causes"]] == ["kernel", "lobe"]
    assert z["causes"] == [] and "no error beyond" in sentence(z)
    assert "lobe costs most, 80%" in sentence(x) and "most in b (90%)" in sentence(x)


def test_section_has_a_row_a_technique_and_a_colour_a_cause():
    shown = page.section({"causes": causes(CELLS)})
    assert [row["technique"] for row in shown["rows"]] == ["x", "y", "z"]
    assert set(shown["colours"]) == {"lobe", "kernel"} and len(set(shown["colours"].values())) == 2
    assert shown["colours"]["lobe"] == page.COLOURS["lobe"]
    assert "lobe costs most, 80%" in shown["sentence"] and "no error beyond" not in shown["sentence"]
    assert page.section({"causes": []}) is None
