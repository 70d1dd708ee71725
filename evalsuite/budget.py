"""`run --budget 10m`: a run that takes about so long, its samples spent where they decide most.

As in `rounds`, what decides how long to sample is not what is reported. A pilot makes all cells at a coarse error. What it saw
says how many undecided pairs a finer reference would decide, and how much narrower intervals would be; what references took says
how long. The time left goes where these gain most, to fresh references (the next seed) whose size is settled before they begin,
and which are reported whatever they say. A pair has the two looks of `rounds`, each at `OF_TWO`.

References are begun a batch at a time: how long one batch took corrects what the next is thought to take.
"""

from __future__ import annotations

import contextlib
import math
import re
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from evalsuite import forecast
from evalsuite.allotment import SIGMAS, Group, Offer, best
from evalsuite.errors import EvalsuiteError, WorkerFailed
from evalsuite.pipeline import Run, evaluate_all
from evalsuite.plan import QUALITY, Cell, usual_cap
from evalsuite.rounds import OF_TWO, Made, decide, half, name_of, stated, tellable, told
from evalsuite.sampling_law import Law, errors_of

#: Relative standard errors of the pilot: where there is time for it, and else.
PILOT, COARSE = QUALITY["draft"][0], 0.1
#: Quality to go to where none is asked for.
FINEST = "publication"
#: Part of the time left that is given to fresh references: how long they take is known to a fifth or so.
GIVEN = 0.8
#: Seconds foretold that count as kept to before any were: one batch tells little of the next.
SURE = 5.0
#: Samples that a reference may take of those foretold, so that none takes far longer.
AT_MOST = 1.25


def seconds_of(text: str) -> float:
    """Of `90s`, `10m`, `2h`, `1h30m`. Raises EvalsuiteError for anything else, and for no time at all."""
    found = re.fullmatch(r"(?:(\d{1,6})h)?(?:(\d{1,6})m)?(?:(\d{1,6})s)?", text.strip().lower())
    seconds = sum(int(part or 0) * unit for part, unit in zip(found.groups(), (3600, 60, 1), strict=True)) if found else 0
    if not seconds:
        raise EvalsuiteError(f"--budget {text}", "no time", "hours, minutes and seconds, as 90s, 10m, 2h or 1h30m")
    return float(seconds)


def pilot(run: Run, cells: Sequence[Cell], seconds: float) -> Run:
    """The run at its pilot's error: as a draft where earlier runs of these scenes let expect it in a third of the budget, else
    coarser."""

    def at(error: float) -> Run:
        error = max(error, run.settings.target_error)
        return run.twin(replace(run.settings, target_error=error, cap=min(usual_cap(error), run.settings.cap)), run.progress)

    with contextlib.suppress(WorkerFailed):  # its cells will say so
        if forecast.at_hand(run, cells) and forecast.forecast(at(PILOT), cells).seconds[0] <= seconds / 3:
            return at(PILOT)
    return at(COARSE)


def spend(
    run: Run,
    first: Run,
    cells: Sequence[Cell],
    made: Sequence[Made],
    seconds: float,
    clock: Callable[[], float],
) -> tuple[list[Made], list[dict], dict]:
    """What is reported of cells that `first`, the pilot's run, has made: as `rounds.decide`, and `budget` of results.json.

    run: with the finest error and the cap to go to. seconds: the budget. clock: seconds since the run began. Raises MachineLacks.
    """
    made, comparisons = decide(first, made, OF_TWO)
    before, taken = _undecided(comparisons), clock()
    if taken > seconds:
        run.progress.warn(
            f"--budget of {seconds:.0f} s: the first look at all cells took {taken:.0f} s, nothing is left to spend"
        )
    prices = _Prices.of(run, first, cells)
    groups = [replace(group, offers=tuple(prices.offers(group))) for group in _groups(made, comparisons)]
    spent, foretold, took = [], 0.0, 0.0
    while jobs := best(groups, GIVEN * (seconds - clock() - _closing(made)) * (foretold + SURE) / (took + SURE)):
        began, again = clock(), _make(run, cells, jobs)
        for (group, offer), fresh in zip(jobs, again, strict=True):
            for index, result in zip(group.cells, fresh, strict=True):
                made[index] = result
            spent.append(_entry(run, cells, group, offer, fresh))
        foretold, took = foretold + sum(offer.seconds for _, offer in jobs), took + clock() - began
        groups = [group for group in groups if all(group is not done for done, _ in jobs)]
    if spent:
        made, comparisons = decide(run, made, OF_TWO)
    found = {"asked_s": seconds, "taken_s": round(clock(), 1), "pilot_error": first.settings.target_error, "spent": spent}
    return made, comparisons, found | {"undecided_before": before, "undecided_after": _undecided(comparisons)}


def _groups(made: Sequence[Made], comparisons: Sequence[dict]) -> list[Group]:
    """Scored cells by their reference, and what of them is undecided."""
    indices: dict[str, list[int]] = defaultdict(list)
    for index, (cell, _) in enumerate(made):
        if cell["status"] == "scored":
            indices[cell.get("reference_id") or cell["id"]].append(index)
    open_pairs: dict[str, list[tuple[float, float]]] = defaultdict(list)
    ids = {cell["id"]: cell.get("reference_id") for cell, _ in made}
    for pair in (pair for order in comparisons for pair in order["pairs"]):
        if tellable(pair) and not pair["decided"]:
            open_pairs[ids[pair["better"]]].append((pair["difference"]["value"], half(pair) / SIGMAS))
    return [
        Group(
            name_of([made[i][0] for i in members]),
            tuple(members),
            made[members[0]][0]["reached_error"],
            tuple(open_pairs[name]),
            tuple(_width(made[i][0]["metrics"]["rel_rmse"]) for i in members),
        )
        for name, members in indices.items()
    ]


def _width(metric: dict) -> float:
    """Half of an interval over its value, 1 at most and where there is none."""
    value, ends = metric["value"], metric["ci95"]
    if not value or None in ends:
        return 1.0
    return min((ends[1] - ends[0]) / 2 / abs(value), 1.0)


def _undecided(comparisons: Sequence[dict]) -> int:
    return sum(tellable(pair) and not pair["decided"] for order in comparisons for pair in order["pairs"])


def _closing(made: Sequence[Made]) -> float:
    """Seconds that writing results and page takes, about."""
    return 1.0 + sum(0.2 + 5e-6 * (cell.get("mask_pixels") or 0) for cell, _ in made)


@dataclass(frozen=True)
class _Prices:
    """How long making a group again would take, from what the pilot and earlier runs took."""

    run: Run
    first: Run
    cells: Sequence[Cell]
    law: Law
    shares: np.ndarray

    @classmethod
    def of(cls, run: Run, first: Run, cells: Sequence[Cell]) -> _Prices:
        references, runs = forecast.known(run)
        return cls(run, first, cells, Law.of(references), forecast.weights_of(runs))

    def offers(self, group: Group) -> Iterator[Offer]:
        """Errors a factor of √2 apart, from the pilot's down to the run's; none where its references are not at hand."""
        references, again = {}, 0.0
        for index in group.cells:
            _, likes, pixels = forecast.steps_of(self.first, self.cells[index])
            again += float(np.array([1.0, 1.0, pixels / 1e6]) @ self.shares[1:4])  # the next seed's pictures are drawn too
            for key, like in likes.items():
                meta = self.first.found("reference", key)
                if meta is None:
                    return
                references[key] = like, pixels, errors_of(meta)
        finest, cap = self.run.settings.target_error, self.run.settings.cap
        errors = (max(stated(group.error / math.sqrt(2) ** k), finest) for k in range(1, 40))
        for error in sorted({error for error in errors if error < group.error}, reverse=True):
            efforts = [self.law.effort(errors, pixels, error, cap) for _, pixels, errors in references.values()]
            seconds = sum(
                self.law.seconds(one, like, pixels) for one, (like, pixels, _) in zip(efforts, references.values(), strict=True)
            )
            most = min(math.ceil(AT_MOST * max(one.spp for one in efforts)), cap)
            yield Offer(error, most, float(seconds * self.shares[-1] + again))


def _make(run: Run, cells: Sequence[Cell], jobs: Sequence[tuple[Group, Offer]]) -> list[list[Made]]:
    """Each job's cells, made with fresh references."""
    asked = [(_finer(run, offer), cells[index]) for group, offer in jobs for index in group.cells]
    made = iter(evaluate_all(asked))
    return [[next(made) for _ in group.cells] for group, _ in jobs]


def _finer(run: Run, offer: Offer) -> Run:
    return told(run, "budget, fresh samples", target_error=offer.error, cap=offer.cap, seed=run.settings.seed + 1)


def _entry(run: Run, cells: Sequence[Cell], group: Group, offer: Offer, made: Sequence[Made]) -> dict:
    """What was spent on a group, as `results.json` has it; its cells say so in their notes."""
    cost, why = made[0][0]["cost"], group.why(offer.error)
    for cell, _ in made:
        cell["notes"].append(f"budget: fresh samples, {offer.error:.2g} of relative standard error: {why}")
    finer = _finer(run, offer)
    keys = {key for index in group.cells for key in forecast.steps_of(finer, cells[index])[1]}
    seconds = sum(meta["seconds"] for key in keys if (meta := finer.found("reference", key)))
    return {"group": group.name, "error": offer.error, "spp": cost.get("reference_spp"), "seconds": round(seconds, 1), "why": why}
