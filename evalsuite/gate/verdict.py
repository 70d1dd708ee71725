"""Each cell of a run against what was blessed: is the picture another, is it closer to the truth or further, could noise say so?

Three things are held against the baseline, as each can change without the others:

- the **picture**: bit for bit first; if it changed, old and new against the new run's reference (`compare.runs`, paired), beyond
  what drift or another driver explain (`tolerance`);
- the **truth**: bit for bit first; if it changed, by more than its noise (`record.same_truth`). Then nothing blessed holds;
- the **measure**: of a picture and a truth that are what they were, every metric must be what it was.

Of many changed cells one would differ by chance: the confidence is that all verdicts of a check hold together (Bonferroni)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from evalsuite.compare.run_folder import Run, changes
from evalsuite.compare.runs import BEYOND, TOLD, apart, compare_cell
from evalsuite.compare.unified import Z95
from evalsuite.gate.baseline import Baseline
from evalsuite.gate.record import Record, picture_digest, reference_digest
from evalsuite.gate.tolerance import DRIFT, tolerance
from evalsuite.image.rounding import bits_in

#: Probability that no cell of a check is called closer or further by noise alone.
CONFIDENCE = 0.99
#: Relative difference of a metric that was computed twice from the same bits: another processor's sums.
RECOMPUTED = 1e-6
#: Metrics of the order of 1 whatever the scene's unit, for references of other samples.
UNITLESS = ("rel_rmse", "relmse", "rel_bias", "smape", "ssim", "flip", "flip_hdr")
#: Verdict → whether the gate lets it pass.
VERDICTS = {
    "failed": False,
    "missing": False,
    "extra": False,
    "other truth": False,
    "other measure": False,
    "further": False,
    "inconclusive": True,
    "closer": True,
    "tolerated": True,
    "unchanged": True,
}


@dataclass(frozen=True)
class Blessed(Run):
    """A blessed cell as if it were one of a run: its own picture, beside the reference of the run that is checked."""

    fresh: Run
    cell: Mapping
    record: Record

    def picture(self, cell: Mapping, name: str, optional: bool = False) -> np.ndarray | None:
        if name in ("reference", "standard_error"):
            return self.fresh.picture(self.cell, name)
        own = {"image": self.record.image, "image_standard_error": self.record.noise}
        own["mask"] = np.repeat(self.record.mask[..., None], 3, axis=2)
        return None if own[name] is None else own[name].astype(np.float64)

    def step(self, cell: Mapping) -> float:
        return 2.0 ** -bits_in(self.record.image)


def judge(run: Run, baseline: Baseline, complete: bool = True) -> list[dict]:
    """Every cell of the run, then those that only the baseline has (with `complete`: else the run was asked for fewer), as in
    check.json (docs/gate.md). Raises EvalsuiteError for pictures that cannot be read."""
    fresh, renderer = run.cells, (run.results.get("host") or {}).get("gl_renderer")
    rows = [_cell(run, cell, baseline, renderer) for cell in fresh.values()]
    open_ = [row for row in rows if row["verdict"] is None]
    limit = float(ndtri(1 - (1 - CONFIDENCE) / 2 / max(len(open_), 1))) / Z95
    for row in open_:
        row |= _decided(row, limit)
    if complete:
        gone = [identity for identity in baseline.cells if identity not in fresh]
        rows += [_row(name, baseline.cells[name], "missing", "blessed, but not in this run") for name in gone]
    return [row | {"passed": VERDICTS[row["verdict"]]} for row in rows]


def _row(identity: str, cell: Mapping, verdict: str | None, reason: str, **more: object) -> dict:
    return {
        "id": identity,
        "technique": cell.get("technique"),
        "target": cell.get("target"),
        "status": cell.get("status"),
        "verdict": verdict,
        "reason": reason,
        "changed": None,
        "direction": None,
        "significant": None,
        "basis": None,
        "quantity": None,
        "difference": None,
        "relative": None,
        "picture_change": None,
        "tolerance": None,
        "scale": None,
        "metrics": {},
        "changes": [],
        "disagree": [],
        **more,
    }


def _cell(run: Run, cell: Mapping, baseline: Baseline, renderer: str | None) -> dict:
    identity, old = cell["id"], baseline.cells.get(cell["id"])
    if cell["status"] not in ("scored", "skipped"):
        return _row(identity, cell, "failed", f"{cell['status']}: {cell.get('message') or 'no reason given'}")
    if old is None:
        return _row(identity, cell, "extra", "not in the baseline: bless it")
    if cell["status"] == "skipped" or old["status"] == "skipped":
        if cell["status"] == old["status"]:
            return _row(identity, cell, "unchanged", "skipped, as blessed", changed=False)
        return _row(identity, cell, "failed", f"{cell['status']}, but blessed as {old['status']}: {cell.get('message') or ''}")
    return _scored(run, cell, baseline, renderer)


def _scored(run: Run, cell: Mapping, baseline: Baseline, renderer: str | None) -> dict:
    """The row of a cell that is scored on both sides; its verdict is None while the confidence is not known."""
    identity = cell["id"]
    old = baseline.cells[identity] | {"id": identity, "all_parameters": baseline.cells[identity].get("parameters"), "images": {}}
    record = baseline.record(identity)
    image, mask, reference, sigma = (run.picture(cell, name) for name in ("image", "mask", "reference", "standard_error"))
    noise = run.picture(cell, "image_standard_error", optional=True)
    inside = mask[..., 0] > 0.5
    same_picture = picture_digest(image, inside, noise) == old["image"]
    same_reference = reference_digest(reference, sigma) == old["reference"]
    metrics = {name: {"before": old["metrics"].get(name), "now": (cell.get("metrics") or {}).get(name)} for name in TOLD}
    allowed = tolerance(str(cell.get("technique")), baseline.renderer(old), renderer)
    row = _row(identity, cell, None, "", metrics=metrics, changes=_changes(old, cell), changed=not same_picture)
    row |= {"tolerance": allowed._asdict(), "scale": float(reference[inside].mean()) if inside.any() else 0.0}

    if not same_reference and record is not None and not record.same_truth(reference, sigma):
        return row | _difference(old, cell, *apart(old, cell, "rel_rmse")) | {
            "verdict": "other truth",
            "reason": "the truth itself changed by more than its noise: scene, light, material, size or Mitsuba plugin",
        }  # fmt: skip
    same_mask = np.array_equal(inside, record.mask) if record else int(inside.sum()) == old.get("mask_pixels", inside.sum())
    if not same_mask and allowed.reason == "drift":  # another driver may see a silhouette otherwise
        pixels = f"{old.get('mask_pixels')} → {int(inside.sum())} pixels"
        return row | {"verdict": "other measure", "reason": f"the object mask changed: {pixels}"}
    if not same_picture and record is not None:
        found = compare_cell(Blessed(run.directory, {}, run, cell, record), old, run, cell)
        row |= {name: found[name] for name in ("basis", "quantity", "difference", "relative", "disagree")}
        both = inside & record.mask if inside.shape == record.mask.shape else np.zeros(1, bool)
        if both.any():
            moved, scale = np.sqrt(np.square(image[both] - record.image[both]).mean()), np.abs(reference[both]).mean()
            row["picture_change"] = float(moved / scale) if scale else None
        within = row["picture_change"] is not None and row["picture_change"] <= allowed.allowed
        same_picture = found["basis"] == "identical" or within
    elif not same_picture:
        row |= _difference(old, cell, *apart(old, cell, "mse" if same_reference else "rel_rmse"))
    if not same_picture:
        return row
    otherwise = _otherwise(old["metrics"], cell.get("metrics") or {}, same_reference) if not row["changed"] else []
    if otherwise:
        reason = f"the picture is as blessed, but measured otherwise: {', '.join(otherwise)}"
        return row | {"verdict": "other measure", "reason": reason}
    if not row["changed"]:
        reason = "the same picture, bit for bit"
    elif row["basis"] == "identical":
        reason = "the same picture but for the rounding of floats"
    else:
        reason = (
            f"the picture changed by {row['picture_change']:.2g} of the mean, within {allowed.allowed:g} for {allowed.reason}"
        )
    return row | {"verdict": "unchanged", "reason": reason}


def _changes(old: Mapping, cell: Mapping) -> list[dict]:
    return [one for one in changes(old, cell) if one["what"] != "message"]


def _difference(old: Mapping, cell: Mapping, basis: str, quantity: str, difference: object) -> dict:
    whole = old["metrics"]["mse"]["value"] if quantity == "mse" else (old["metrics"]["rel_rmse"]["value"] or 0.0) ** 2
    relative = None
    if whole and whole > 0:
        low, high = (end / whole for end in difference.ci95)
        relative = {"value": difference.value / whole, "ci95": [_finite(low), _finite(high)]}
    return {"basis": basis, "quantity": quantity, "difference": difference.to_json(), "relative": relative}


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _decided(row: Mapping, limit: float) -> dict:
    """The verdict of a changed picture; limit: half widths of the 95 % interval that the check's confidence asks for."""
    value = row["difference"]["value"]
    low, high = (None if end is None or value is None else value + limit * (end - value) for end in row["difference"]["ci95"])
    worst = _allowance(row)
    if low is not None and low > worst:
        verdict = "further"
    elif high is not None and high < 0:
        verdict = "closer"
    elif high is not None and high <= worst:
        verdict = "tolerated"
    else:
        verdict = "inconclusive"
    direction = None if not value else "further" if value > 0 else "closer"
    told = {
        "further": "further from the truth",
        "closer": "closer to the truth: bless it to keep it so",
        "tolerated": f"no further from the truth than {row['tolerance']['reason']} explains",
        "inconclusive": "the picture changed; noise hides whether it is closer to the truth or further",
    }[verdict]
    share = (row["relative"] or {}).get("value")
    size = "" if share is None else f", squared error {share:+.3g} of what it was"
    return {
        "verdict": verdict,
        "direction": direction,
        "significant": verdict in ("further", "closer"),
        "reason": f"{told}{size}",
    }


def _allowance(row: Mapping) -> float:
    """What the tolerance can add to the squared error: (e + t)² − e² with e the root mean square error and t as its unit says."""
    before = row["metrics"]["rel_rmse"]["before"] or {}
    error, allowed = before.get("value") or 0.0, row["tolerance"]["allowed"]
    relative = (error + allowed) ** 2 - error**2
    return relative * (row["scale"] ** 2 if row["quantity"] == "mse" else 1.0)


def _otherwise(old: Mapping, new: Mapping, same_bits: bool) -> list[str]:
    """Metrics that are not what they were, for a picture and a truth that are: of the same bits all of them, else those without a
    unit, as far as their intervals tell."""
    names = set(old) | {name for name in new if not name.endswith("_full")} if same_bits else set(UNITLESS)
    agree = _recomputed if same_bits else _within_noise
    return [name for name in sorted(names) if not agree(old.get(name), new.get(name))]


def _recomputed(a: Mapping | None, b: Mapping | None) -> bool:
    if a is None or b is None:
        return False
    pairs = zip((a["value"], *a["ci95"]), (b["value"], *b["ci95"]), strict=True)
    return all(x == y or (None not in (x, y) and math.isclose(x, y, rel_tol=RECOMPUTED, abs_tol=1e-12)) for x, y in pairs)


def _within_noise(a: Mapping | None, b: Mapping | None) -> bool:
    """Whether intervals of BEYOND times their width, and ten times the drift, have a value in common."""
    if a is None or b is None:
        return a is b
    if a["value"] is None or b["value"] is None:
        return True
    (a_low, a_high), (b_low, b_high) = _wide(a), _wide(b)
    return a_low <= b_high and b_low <= a_high


def _wide(metric: Mapping) -> tuple[float, float]:
    value, (low, high) = metric["value"], metric["ci95"]
    below = math.inf if low is None else BEYOND * (value - low)
    above = math.inf if high is None else BEYOND * (high - value)
    return value - below - 10 * DRIFT, value + above + 10 * DRIFT
