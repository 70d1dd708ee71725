"""Passes of a reference added up: mean, per-pixel standard error and skew, two independent halves; and when they suffice.

Pass k has the same number of multi-jittered samples with a seed made of (seed, k), and its mean is added in float64, in
order, whoever rendered it. So a stopped run continues to the same bits, a longer run contains the shorter one, and one worker
finds what many find. Samples within a pass are stratified against each other (a tenth of the variance of independent ones in
smooth lighting), hence not independent; the passes are, so the standard error comes from their scatter alone.
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from evalsuite.errors import EvalsuiteError
from evalsuite.store.cache import write_atomic
from evalsuite.store.checksums import seal, unseal

MIN_PASSES = 8  # fewer say little about their own scatter: with 8 a pixel's standard error is known to 1/√(2·7) = 27 %
LOOK = 2  # of a rung: its mean error over a whole picture is then known to 8 % (the built-in scenes at 64²), enough to climb

#: Samples per pixel of a pass. Powers of four: multi-jittering takes squares as they are, and powers of two make film
#: sums bit-identical on any number of threads. More samples stratify better, fewer find out sooner that they suffice.
RUNGS = (16, 64, 256, 1024)
CLIMB = 4 * MIN_PASSES  # passes needed at which the fewest of the next rung cost no more than staying
#: How many times fewer passes the next rung usually needs: four times the samples, stratified better. Of 35 built-in references.
GAINS = {16: 6.6, 64: 5.7, 256: 5.1}
MAX_PASS_SAMPLES = 2**27  # of a pass over the whole film: about ten seconds on two cores


@dataclass(frozen=True, eq=False)
class RenderState:
    """Everything that a reference has gathered so far; picklable.

    even, odd: (H, W, 3) float64 sums of the radiance of even and odd passes: two independent halves. squares, cubes: (H, W, 3)
    float64 sums of the squares and cubes of all passes' radiance. pass_spp: samples per pixel of one pass, (H, W) int32 where
    pixels differ (`reference.adaptive`). passes: how many. seed: the run's. seconds, processor: spent on rendering, of the
    clock and of processors, all threads (not part of the result). look, planned: how many states that one was planned by, which
    gave themselves up for it; and how many passes.
    """

    even: NDArray[np.float64]
    odd: NDArray[np.float64]
    squares: NDArray[np.float64]
    cubes: NDArray[np.float64]
    pass_spp: int | NDArray[np.int32]
    passes: int
    seed: int
    seconds: float = 0.0
    look: int = 0
    planned: int = 0
    processor: float = 0.0

    @property
    def pass_samples(self) -> int:
        """Samples of one pass over the whole picture."""
        return int(np.broadcast_to(self.pass_spp, self.even.shape[:2]).sum(dtype=np.int64))

    @property
    def spp(self) -> int:
        """Samples per pixel so far; where pixels differ, their mean."""
        return round(self.passes * self.pass_samples / math.prod(self.even.shape[:2]))

    @property
    def mean(self) -> NDArray[np.float32]:
        """Radiance, (H, W, 3)."""
        return ((self.even + self.odd) / self.passes).astype(np.float32)

    @property
    def standard_error(self) -> NDArray[np.float32]:
        """Of `mean`, (H, W, 3): √(unbiased variance of a pass / passes), with passes − 1 degrees of freedom; infinite for a
        single pass. Never below 2⁻²² of the mean: a pass is a float32 sum, whose rounding does not average out."""
        k = self.passes
        if k < 2:
            return np.full(self.even.shape, np.inf, np.float32)
        mean = (self.even + self.odd) / k
        variance = np.maximum(self.squares / k - mean**2, 0.0) * (k / (k - 1.0))
        return np.maximum(np.sqrt(variance / k), 2.0**-22 * np.abs(mean)).astype(np.float32)

    @property
    def skew(self) -> NDArray[np.float32]:
        """Cube root of the third cumulant of `mean`'s noise [radiance], (H, W, 3): that of a pass, without bias (k-statistic),
        over passes²; 0 for fewer than three. Of a normal variable it is 0, of radiance that few samples find positive."""
        k = self.passes
        if k < 3:
            return np.zeros(self.even.shape, np.float32)
        mean = (self.even + self.odd) / k
        central = self.cubes / k - 3 * mean * (self.squares / k) + 2 * mean**3
        return np.cbrt(central / ((k - 1.0) * (k - 2.0))).astype(np.float32)

    @property
    def halves(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Means of the even and of the odd passes, independent of each other; needs two passes."""
        odd_passes = self.passes // 2
        if odd_passes == 0:
            raise EvalsuiteError("reference", "one pass", "at least two, one for each half")
        return (self.even / (self.passes - odd_passes)).astype(np.float32), (self.odd / odd_passes).astype(np.float32)


_STATE = ("even", "odd", "squares", "cubes", "pass_spp", "passes", "seconds", "look", "planned", "processor")


def save_state(state: RenderState, path: Path) -> None:
    """Write a state to a file, a sealed .npz, atomically. Raises Unwritable when the folder cannot be written."""
    data = io.BytesIO()
    np.savez(data, **{name: getattr(state, name) for name in _STATE}, seed=np.uint64(state.seed))
    write_atomic(path, seal(data.getvalue()))


def load_state(path: Path, seed: int) -> RenderState | None:
    """A state from its file; None when there is none, or what is there is damaged or of another seed."""
    try:
        whole = unseal(path.read_bytes())
    except OSError:
        return None
    if whole is None:
        return None
    with np.load(io.BytesIO(whole)) as data:
        values = {name: data[name] for name in _STATE}
        if int(data["seed"]) != seed:
            return None
    return RenderState(
        values["even"],
        values["odd"],
        values["squares"],
        values["cubes"],
        values["pass_spp"] if values["pass_spp"].ndim else int(values["pass_spp"]),
        int(values["passes"]),
        seed,
        float(values["seconds"]),
        int(values["look"]),
        int(values["planned"]),
        float(values["processor"]),
    )


def blank(
    size: tuple[int, int],
    seed: int = 0,
    pass_spp: int | NDArray[np.int32] = RUNGS[0],
    look: int = 0,
    planned: int = 0,
) -> RenderState:
    """A state without any pass. size: (width, height)."""
    zeros = np.zeros((size[1], size[0], 3))
    return RenderState(zeros, zeros, zeros, zeros, pass_spp, 0, seed, 0.0, look, planned)


def instead(state: RenderState, pass_spp: int | NDArray[np.int32], look: int = 0, planned: int = 0) -> RenderState:
    """A state without any pass for one that is given up, whose time stays spent."""
    fresh = blank(state.even.shape[1::-1], state.seed, pass_spp, look, planned)
    return replace(fresh, seconds=state.seconds, processor=state.processor)


def added(
    state: RenderState, radiance: Iterable[NDArray[np.float32]], seconds: float = 0.0, processor: float = 0.0
) -> RenderState:
    """The state after further passes. radiance: (H, W, 3) of each, from number `state.passes` on. seconds, processor: what they
    took."""
    even, odd, squares, cubes = (sums.copy() for sums in (state.even, state.odd, state.squares, state.cubes))
    number = state.passes
    for image in radiance:
        image = np.asarray(image, np.float64)
        (odd if number % 2 else even)[...] += image
        squares += image**2
        cubes += image**3
        number += 1
    took = {"seconds": state.seconds + seconds, "processor": state.processor + processor}
    return replace(state, even=even, odd=odd, squares=squares, cubes=cubes, passes=number, **took)


def pass_seed(seed: int, number: int, *part: int) -> int:
    """32-bit seed of a pass, mixed so that neither neighbouring runs nor neighbouring passes share streams. part: which of a
    pass's streams; its first number is not 0."""
    return int(np.random.SeedSequence([seed, number, *part]).generate_state(1)[0])


#: Side of the window over which neighbouring pixels' variances are pooled.
POOL = 5
#: A pixel whose own variance is this many times its neighbours' keeps its own: beyond what chance does to an estimate from
#: eight passes (99.9 % of χ²₇/7 lies below 3.5).
OUTLIER = 3.5


def standard_error(state: RenderState, mask: NDArray | None = None) -> NDArray[np.float32]:
    """Standard error of `state.mean`, (H, W, 3), with each pixel's variance pooled over its neighbours on the same side of
    `mask` (a picture without one is all one side).

    A few passes know a pixel's own scatter to a quarter at best, and a Z-test with such an error has heavy tails (Student's
    t). The noise changes slowly over an object, so its neighbours know the same scatter: 25 pixels make it good to 5 %.
    """
    own = state.standard_error.astype(np.float64) ** 2
    inside = np.ones(own.shape[:2], bool) if mask is None else np.asarray(mask) > 0
    pooled = own.copy()
    for side in (inside, ~inside):
        if side.any():
            weight = ndimage.uniform_filter(side.astype(np.float64), POOL, mode="constant")[..., None]
            total = ndimage.uniform_filter(np.where(side[..., None], own, 0.0), (POOL, POOL, 1), mode="constant")
            local = np.divide(total, weight, out=np.zeros_like(total), where=weight > 0)
            agrees = side[..., None] & (own <= OUTLIER * local)
            pooled[agrees] = local[agrees]
    return np.sqrt(np.maximum(pooled, 0.0)).astype(np.float32)


def relative_error(state: RenderState, mask: NDArray | None = None) -> float:
    """mean SE / mean L over mask's pixels (all where None) and channels: the standard error that a pixel has on average,
    relative to the mean radiance. 0 for a black picture or an empty mask.

    Not the root mean square: a few small highlights would then decide how long a whole picture is sampled; their own
    standard errors are larger, and every metric's interval carries them."""
    error, mean = standard_error(state, mask).astype(np.float64), state.mean.astype(np.float64)
    if mask is not None:
        inside = np.asarray(mask) > 0
        error, mean = error[inside], mean[inside]
    if mean.size == 0 or mean.mean() == 0.0:
        return 0.0
    return float(error.mean() / abs(mean.mean()))


def plan(state: RenderState, target_error: float, cap_spp: int, mask: NDArray | None = None) -> int:
    """How many passes to render next: 0 when the relative error or the cap is reached; never more than doubles the passes,
    since the first estimates are rough; even where the cap allows, to keep the halves balanced. Deterministic."""
    pixels = math.prod(state.even.shape[:2])
    cap = max(cap_spp * pixels // state.pass_samples, 2)
    if state.passes < LOOK and may_climb(state.pass_spp, pixels, cap_spp):
        return LOOK - state.passes
    goal = min(MIN_PASSES, cap)
    if state.passes >= goal:
        error = relative_error(state, mask)
        if error <= target_error or state.passes >= cap:
            return 0
        goal = min(math.ceil(state.passes * (error / target_error) ** 2), 2 * state.passes, cap)
    more = max(goal - state.passes, 1)
    return min(more + more % 2, max(cap - state.passes, 1))


def rung(state: RenderState, target_error: float, cap_spp: int, mask: NDArray | None = None) -> int:
    """Samples per pixel of a pass to go on with: the state's, or more, to start over with. Better stratification then saves more
    than the few samples thrown away (1413 instead of 3033 samples a pixel from 16 to 64, 692 with 256, for a Phong sphere,
    N = 10, in an interior). Asked after the first passes, and once more of a better known error."""
    if state.passes not in (LOOK, MIN_PASSES):
        return state.pass_spp
    needed = state.passes * (relative_error(state, mask) / target_error) ** 2
    return rung_for(state.pass_spp, needed, math.prod(state.even.shape[:2]), cap_spp)


def rung_for(pass_spp: int, needed: float, pixels: int, cap_spp: int) -> int:
    """The rung for a picture that needs so many passes of `pass_spp` samples. One where it would usually not stay either is
    passed over: its look would be thrown away as well."""
    while needed > CLIMB and may_climb(pass_spp, pixels, cap_spp):
        needed /= GAINS[pass_spp]
        pass_spp *= 4
    return pass_spp


def may_climb(pass_spp: int, pixels: int, cap_spp: int) -> bool:
    """Whether passes of `pass_spp` samples a pixel have a next rung, and the cap allows enough passes there."""
    longer = 4 * pass_spp
    return longer <= RUNGS[-1] and longer * pixels <= MAX_PASS_SAMPLES and longer * MIN_PASSES <= cap_spp
