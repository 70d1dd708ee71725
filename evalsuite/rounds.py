"""Orders of techniques that noise could change: found, marked, and sampled until they are decided.

Sampling until a result looks decided, and reporting the samples that made it look so, would report noise: each look is one more
chance for it. So the looks and the report are kept apart. A pilot halves the reference's error, with the run's own seed, until
every pair is decided with `MARGIN` to spare; what is reported is then one fresh reference (the next seed) of the size that the
pilot chose, whatever it says. Given its size, its samples are as independent of any choice as those of a plain run, and so are
its intervals. A pair has two reportable looks, the plain run's and the fresh one, each at 97.5 % confidence, which makes 95 %.

A pilot that would sample more than a quarter of the cap is left out: the fresh reference then goes where the last one says that
it must, at most to the cap, and all pilots together cost about a third of that.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from evalsuite.pipeline import Run, run_cells
from evalsuite.plan import Cell
from evalsuite.settings import Progress
from evalsuite.store.cache import file_digest

Made = tuple[dict, dict[str, Path]]

CONFIDENCE = 0.95
#: Of each of two looks: by Bonferroni's inequality both together mislead in 5 % at most.
OF_TWO = 0.975
#: Half widths of the 95 % interval that a pilot's difference must reach: (2.24 + 1.28) / 1.96, so that the fresh reference's, as
#: wide, exceeds its own 97.5 % in nine of ten cases.
MARGIN = 1.8


def decide(run: Run, made: Sequence[Made], confidence: float = CONFIDENCE) -> tuple[list[Made], list[dict]]:
    """The cells with `decided`, and the orders of those that share a reference: `comparisons` of results.json."""
    groups: dict[str, list[int]] = defaultdict(list)
    for index, (cell, files) in enumerate(made):
        if cell["status"] == "scored":
            # A file in the run's folder is rounded: only the id says that it is the very same reference.
            groups[cell.get("reference_id") or file_digest(files["reference"])].append(index)
    tasks = {
        tuple(group): run.workers.compare.submit(
            "evalsuite.compare.cell:rank_cells", {made[i][0]["id"]: made[i][1] for i in group}, confidence
        )
        for group in groups.values()
        if len(group) > 1
    }
    comparisons, verdicts = [], {}
    for group, task in tasks.items():
        found = task.result()
        members = [made[i][0] for i in group]
        comparisons.append({"group": name_of(members), "metric": "mse", "confidence": confidence, **found})
        for pair in found["pairs"]:
            for name in (pair["better"], pair["worse"]):
                verdicts[name] = verdicts.get(name, True) and pair["decided"]
    return [(cell | {"decided": verdicts.get(cell["id"])}, files) for cell, files in made], comparisons


def until_decided(run: Run, cells: Sequence[Cell], made: Sequence[Made]) -> tuple[list[Made], list[dict]]:
    """As `decide`, after the references of undecided cells, and no others, were sampled on. Raises MachineLacks."""
    made, comparisons = decide(run, made, OF_TWO)
    by_id = {cell.id: index for index, cell in enumerate(cells)}
    settings, fresh, looks = run.settings, defaultdict(list), {}
    for order in comparisons:
        if any(tellable(pair) and not pair["decided"] for pair in order["pairs"]):
            group = tuple(by_id[name] for name in order["order"])
            looks[group] = _Look.of(made[group[0]][0], order["pairs"])
    while looks:
        for group, look in list(looks.items()):
            if look.settled or 16 * look.spp > settings.cap:
                fresh[look.error_of_fresh(settings.cap)].append(group)
                del looks[group]
        for group, look in list(looks.items()):
            finer = told(run, "undecided, pilot", target_error=stated(look.error / 2))
            pilot = run_cells(finer, [cells[i] for i in group])
            _, found = decide(run, pilot)
            # A cell that failed says so in the report, to which its group goes at once.
            looks[group] = _Look.of(pilot[0][0], found[0]["pairs"]) if len(found) == 1 else replace(look, pairs=())
    for error, chosen in fresh.items():
        finer = told(run, "undecided, fresh samples", target_error=error, seed=settings.seed + 1)
        indices = [i for group in chosen for i in group]
        for index, again in zip(indices, run_cells(finer, [cells[i] for i in indices]), strict=True):
            made[index] = again
            spp = again[0]["cost"].get("reference_spp")
            again[0]["notes"].append(f"sampled until decided: fresh samples, {error:.2g} of relative standard error, {spp} spp")
    if fresh:
        made, comparisons = decide(run, made, OF_TWO)
    for cell, _ in made:
        if cell["decided"] is False:
            cell["notes"].append(f"inconclusive at {cell['cost']['reference_spp']} spp, the cap being {settings.cap}")
    return made, comparisons


@dataclass(frozen=True)
class _Look:
    """What a group's pilot has seen: the relative standard error that it reached, samples per pixel, and which pairs."""

    error: float
    spp: int
    pairs: Sequence[dict]

    @classmethod
    def of(cls, cell: dict, pairs: Sequence[dict]) -> _Look:
        return cls(cell["reached_error"], cell["cost"]["reference_spp"], pairs)

    @property
    def margin(self) -> float:
        """The smallest of all pairs that sampling can tell apart: difference over `MARGIN` half widths."""
        return min((p["difference"]["value"] / half(p) for p in self.pairs if tellable(p)), default=math.inf) / MARGIN

    @property
    def settled(self) -> bool:
        return self.margin >= 1.0

    def error_of_fresh(self, cap: int) -> float:
        """At which error the fresh reference is to decide all pairs, or a little below what the cap lets it reach."""
        return stated(self.error * min(max(self.margin, 0.5 * math.sqrt(self.spp / cap)), 1.0))


def stated(error: float) -> float:
    """Two digits, as the command that makes a cell again states it."""
    return float(f"{error:.2g}")


def half(pair: dict) -> float:
    lo, hi = pair["difference"]["ci95"]
    return (hi - lo) / 2


def tellable(pair: dict) -> bool:
    """Whether sampling can tell: equal pictures differ by 0 ± 0."""
    return half(pair) > 0.0


def told(run: Run, what: str, **settings: float) -> Run:
    """The run under other settings, saying so; its cells are not counted again."""
    progress = replace(run.progress, step=lambda text: run.progress.step(f"{what}: {text}"), cell=Progress().cell)
    return run.twin(replace(run.settings, **settings), progress)


def name_of(members: Sequence[dict]) -> str:
    """What the cells of a group have in common: scene/materials and parameters/target."""
    one = members[0]
    plugins = sorted({mapping["plugin"] for mapping in one["mapping"] if mapping.get("scored", True)})
    common = {k: v for k, v in one["parameters"].items() if all(other["parameters"].get(k) == v for other in members)}
    return "/".join([one["scene"], ",".join([*plugins, *(f"{k}={v}" for k, v in common.items())]), one["target"]])
