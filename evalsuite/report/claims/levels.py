"""Claims about box-filtered MIP levels (Kautz, Daubert, Seidel 2004 Fig 5)."""

from __future__ import annotations

from evalsuite.report.claims.verdict import HOLDS, LIMITS, Finding
from evalsuite.report.figures import headroom_boxmip
from evalsuite.report.numbers import measured


def bias_for_phong() -> Finding:
    """The bias whose look-up comes nearest to the Phong lobe of N = 225, over maps, on the scene `sphere` at 256² and faces of
    128²."""
    found = headroom_boxmip.data()["measured"]
    row = next(r for r in found["bias_of_exponent"] if r["exponent"] == 225)
    paper = found["paper"]
    low, high = row["ci95"]
    text = f"best b for N = 225 over {len(found['maps'])} maps: {measured({'value': row['bias'], 'ci95': [low, high]})}"
    numbers = {"bias": row["bias"], "ci95": [low, high], "stated": 2.25} | {k: v for k, v in paper.items() if k != "bias"}
    why = "b counts from the hardware's own level, which picture and face size decide: another size moves it"
    return Finding(HOLDS if low <= 2.25 <= high else LIMITS, text, why, numbers)
