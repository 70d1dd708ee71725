"""What the cells of a run say together: `causes`, `envelopes` and `rankings` of results.json."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from itertools import zip_longest
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare import crossover, disagreement, envelopes, paired, pareto, ranking
from evalsuite.compare.causes import causes
from evalsuite.image import exr

#: Rank flips whose pixels are looked at: each group's strongest first.
FLIPS_LOOKED_AT = 12


class Pictures:
    """A group's pictures from its cells' files, read when first asked for. image(id), reference, sigma: (P, 3) in the pixels that
    count for all of its cells."""

    def __init__(self, files: Mapping[str, Mapping[str, Path]]) -> None:
        self._files, self._images = files, {}

    @cached_property
    def _alike(self) -> Callable[[NDArray], NDArray]:
        return exr.coarsest([files["image"] for files in self._files.values()])

    @cached_property
    def mask(self) -> NDArray[np.bool_]:
        return np.logical_and.reduce([exr.read(files["mask"])[..., 0] > 0.5 for files in self._files.values()])

    @cached_property
    def reference(self) -> NDArray[np.float64]:
        return self._read(next(iter(self._files.values()))["reference"])

    @cached_property
    def sigma(self) -> NDArray[np.float64]:
        return self._read(next(iter(self._files.values()))["standard_error"])

    def image(self, cell: str) -> NDArray[np.float64]:
        if cell not in self._images:
            self._images[cell] = self._read(self._files[cell]["image"])
        return self._images[cell]

    def random(self, cell: str) -> bool:
        """Whether the picture itself carries noise."""
        return "image_standard_error" in self._files[cell]

    def difference(self, metric: str, a: str, b: str) -> tuple[float, float] | None:
        """The paired difference of two of its cells (`compare.paired`); None where one of them carries noise of its own."""
        if self.random(a) or self.random(b):
            return None
        return paired.difference(metric, self.image(a), self.image(b), self.reference, self.sigma)

    def _read(self, path: Path) -> NDArray[np.float64]:
        return self._alike(exr.read(path)[self.mask]).astype(np.float64)


def findings(made: Sequence[tuple[dict, Mapping[str, Path]]]) -> dict:
    """`causes`, `envelopes` and `rankings` of finished cells and their files; None, or empty, where there is nothing to say.

    Raises EvalsuiteError for a picture that cannot be read."""
    cells = [cell for cell, _ in made]
    return {
        "causes": causes(cells),
        "envelopes": _envelopes(cells),
        "rankings": _rankings(cells, {cell["id"]: files for cell, files in made}),
    }


def _envelopes(cells: Sequence[dict]) -> dict | None:
    planes = envelopes.planes(cells)
    if not planes:
        return None
    crossovers = [one for plane in planes for one in crossover.crossovers(plane)]
    return {
        "planes": [
            {"scene": p.scene, "target": p.target, "environment": p.environment, "x": p.x, "y": p.y, "xs": p.xs.tolist(),
             "ys": p.ys.tolist(), "contenders": [c.label for c in p.contenders]}
            for p in planes
        ],
        "crossovers": crossovers,
        "pareto": [one for plane in planes if len(plane.contenders) > 1 for one in pareto.pareto(plane)],
    }  # fmt: skip


def _rankings(cells: Sequence[dict], files: Mapping[str, Mapping[str, Path]]) -> dict | None:
    ranked, pictures = [], {}
    for group in ranking.groups(cells):
        own = pictures[group.reference_id] = Pictures({i: files[i] for i in group.cells})
        ranked.append(ranking.rank(group, own.difference if own.mask.any() else None))
    if not ranked:
        return None
    of_groups = [sorted(one.pop("flips"), key=lambda flip: -flip["strength"]) for one in ranked]
    # Every group's strongest, then every group's second: a sweep repeats one flip many times.
    flips = [
        {"reference_id": group["reference_id"], **flip}
        for row in zip_longest(*of_groups)
        for group, flip in sorted(zip(ranked, row, strict=True), key=lambda p: -p[1]["strength"] if p[1] else 0.0)
        if flip
    ]
    flips.sort(key=lambda flip: flip["strength"] == 0.0)  # what rests on the bias alone comes last
    for flip in flips[:FLIPS_LOOKED_AT]:
        own = pictures[flip["reference_id"]]
        if not own.mask.any():  # no pixel that counts for all of them
            continue
        flip["pixels"] = disagreement.behind(own.image(flip["a"]), own.image(flip["b"]), own.reference, own.sigma)
        flip["text"] = disagreement.sentence(flip)
    kendall = ranking.kendall(ranked)
    for one in ranked:
        del one["concordance"]
    return {"kendall": kendall, "flips": flips, "groups": ranked}
