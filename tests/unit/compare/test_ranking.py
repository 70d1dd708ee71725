"""Ranks, flips and the pixels behind them, on pictures made so that the answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.compare import compare, disagreement, paired, ranking
from evalsuite.compare.findings import findings
from evalsuite.image import exr

SIZE = 64


def scene(seed=0, sigma=0.01):
    """A lit gradient with one bright patch; (truth, reference with noise, its standard error)."""
    rng = np.random.default_rng(seed)
    truth = np.repeat(np.linspace(0.2, 0.6, SIZE)[None, :, None], SIZE, 0) * [1.0, 0.8, 0.6]
    truth[4:10, 4:10] = 5.0
    noise = np.full_like(truth, sigma)
    return truth, truth + sigma * rng.standard_normal((SIZE, SIZE, 1)), noise


def few_outliers(truth):
    """Right but for the bright patch, which is a third too dark: 36 of 4096 pixels."""
    image = truth.copy()
    image[4:10, 4:10] *= 0.67
    return image


def broad(truth):
    """A tenth too bright everywhere but in the patch."""
    image = truth * 1.1
    image[4:10, 4:10] = truth[4:10, 4:10]
    return image


def cell(technique, image, reference, noise, reference_id="r", **parameters):
    compared = compare(image, reference, noise)
    return {
        "id": f"s/{technique}/{parameters}/t", "scene": "s", "technique": technique, "target": "t", "status": "scored",
        "parameters": parameters, "reference_id": reference_id, "metrics": compared.to_json()["metrics"],
    }  # fmt: skip


@pytest.fixture(scope="module")
def flipped():
    truth, reference, noise = scene()
    return [cell(n, f(truth), reference, noise) for n, f in (("outliers", few_outliers), ("broad", broad))]


def test_few_big_outliers_against_a_broad_small_error(flipped):
    (group,) = ranking.groups(flipped)
    (flip,) = ranking.rank(group)["flips"]
    assert {"mae", "smape", "flip"} <= set(flip["prefer_a"])
    assert {"rel_rmse", "psnr"} <= set(flip["prefer_b"])
    assert (flip["a_name"], flip["b_name"]) == ("outliers", "broad")
    assert flip["strength"] > 0.3


def test_ranks_and_tau(flipped):
    (group,) = ranking.groups(flipped)
    ranked = ranking.rank(group)
    assert ranked["ranks"]["mae"] == {"outliers": [1, 1], "broad": [2, 2]}
    assert ranked["ranks"]["rel_rmse"] == {"outliers": [2, 2], "broad": [1, 1]}
    tau = {tuple(t["metrics"]): t for t in ranking.kendall([ranked, ranked])}
    assert tau["rel_rmse", "mae"] == {"metrics": ["rel_rmse", "mae"], "value": -1.0, "ci95": [-1.0, -1.0], "pairs": 2}
    assert tau["rel_rmse", "psnr"]["value"] == 1.0


def metric(value, low, high):
    return {"value": value, "ci95": [low, high]}


def made_up(**metrics):
    return [
        {"id": name, "scene": "s", "technique": name, "target": "t", "status": "scored", "parameters": {}, "reference_id": "r",
         "metrics": {m: v[name] for m, v in metrics.items()}}
        for name in "abc"
    ]  # fmt: skip


def test_overlapping_intervals_tie():
    cells = made_up(mae={"a": metric(1, 0.9, 1.1), "b": metric(1.15, 1.05, 1.2), "c": metric(2, 1.9, 2.1)})
    (group,) = ranking.groups(cells)
    ranked = ranking.rank(group)
    assert ranked["ranks"] == {"mae": {"a": [1, 2], "b": [1, 2], "c": [3, 3]}}
    assert ranked["flips"] == []

    # unless their common noise is taken out
    def closer(metric, a, b):
        return (-0.2, -0.1)

    assert ranking.rank(group, closer)["ranks"]["mae"] == {"a": [1, 1], "b": [2, 2], "c": [3, 3]}


def test_pictures_off_by_rounding_alone_tie():
    tiny = {n: metric(v, v, v) for n, v in {"a": 1e-7, "b": 2e-7, "c": 1e-3}.items()}
    (group,) = ranking.groups(made_up(rel_rmse=tiny, mae=tiny))
    assert ranking.rank(group)["ranks"]["mae"] == {"a": [1, 2], "b": [1, 2], "c": [3, 3]}


def test_tau_says_what_undecided_pairs_leave_open():
    wide = {n: metric(v, v - 9, v + 9) for n, v in {"a": 1, "b": 2, "c": 3}.items()}
    sharp = {n: metric(v, v, v) for n, v in {"a": 3, "b": 2, "c": 1}.items()}
    (group,) = ranking.groups(made_up(mae=wide, smape=sharp))
    (tau,) = ranking.kendall([ranking.rank(group)])
    assert tau["value"] == -1.0 and tau["ci95"] == [-1.0, 1.0] and tau["pairs"] == 3


def test_more_is_better_for_ssim_and_psnr_and_bias_counts_by_size():
    cells = made_up(
        ssim={n: metric(v, v, v) for n, v in {"a": 0.9, "b": 0.8, "c": 0.7}.items()},
        psnr={"a": {"value": None, "ci95": [50, None]}, "b": metric(40, 39, 41), "c": metric(30, 29, 31)},
        rel_bias={"a": metric(0.001, -0.01, 0.012), "b": metric(-0.2, -0.21, -0.19), "c": metric(0.3, 0.29, 0.31)},
    )
    (group,) = ranking.groups(cells)
    for ranks in ranking.rank(group)["ranks"].values():
        assert ranks == {"a": [1, 1], "b": [2, 2], "c": [3, 3]}
    assert [ranking.score(c, "rel_bias") for c in cells] == [(0.001, 0.0, 0.012), (0.2, 0.19, 0.21), (0.3, 0.29, 0.31)]


def test_a_flip_that_rests_on_the_bias_alone_has_no_strength():
    def exact(**values):
        return {n: metric(v, v, v) for n, v in values.items()}

    cells = made_up(mae=exact(a=1, b=2, c=3), rel_bias=exact(a=0.2, b=1e-6, c=0.3), flip=exact(a=0.3, b=0.3, c=0.1))
    (group,) = ranking.groups(cells)
    flips = {(f["a"], f["b"]): f for f in ranking.rank(group)["flips"]}
    assert flips["a", "b"]["strength"] == 0.0 and flips["a", "b"]["prefer_b"] == ["rel_bias"]
    assert flips["a", "c"]["strength"] == pytest.approx(np.log(3))


def test_only_cells_of_one_reference_are_ranked():
    cells = made_up(mae={n: metric(1, 1, 1) for n in "abc"})
    cells[0]["reference_id"], cells[1]["status"] = "other", "failed"
    assert ranking.groups(cells) == []
    assert ranking.groups([{k: v for k, v in c.items() if k != "reference_id"} for c in cells]) == [], "results of before"


@pytest.mark.parametrize("name", ["rel_rmse", "relmse", "mae", "smape", "rel_bias"])
def test_the_paired_interval_covers_the_true_difference(name):
    """Over independent references: at 95 % of 300 trials no fewer than 90 % may cover (10⁻⁴ for a true 95 %)."""
    rng = np.random.default_rng(5)
    truth = rng.uniform(0.2, 1.0, (400, 1)) * [1.0, 0.8, 0.6]
    sigma = 0.1 * truth
    a, b = truth * 1.05, truth + 0.06 * rng.standard_normal(truth.shape)

    def exact(image):
        mean = truth.mean()
        return {
            "rel_rmse": lambda: np.square(image - truth).mean(),
            "relmse": lambda: (np.square(image - truth) / (truth**2 + (0.01 * mean) ** 2)).mean(),
            "mae": lambda: np.abs(image - truth).mean(),
            "smape": lambda: (2 * np.abs(image - truth) / (image + truth)).mean(),
            "rel_bias": lambda: abs((image - truth).mean()),
        }[name]()

    wanted = exact(a) - exact(b)
    covered, widths = 0, []
    for _ in range(300):
        reference = truth + sigma * rng.standard_normal((400, 1))
        low, high = paired.difference(name, a, b, reference, sigma)
        covered += low - 1e-12 <= wanted <= high + 1e-12  # of two biases of one sign the difference is exact
        widths.append(high - low)
    assert covered >= 270
    assert np.median(widths) < 3 * abs(wanted) or name in ("smape", "mae"), "and says something"


def test_pairing_decides_what_two_intervals_leave_open():
    truth, reference, noise = scene(sigma=0.2)
    a, b = truth * 1.10, truth * 1.12
    images = {"a": a, "b": b}
    cells = [cell(n, i, reference, noise) for n, i in images.items()]
    (group,) = ranking.groups(cells)
    one, two = group.cells
    assert ranking.decide(group, "rel_rmse", one, two) == 0

    def difference(metric, x, y):
        flat = (p.reshape(-1, 3) for p in (images[group.names[x]], images[group.names[y]], reference, noise))
        return paired.difference(metric, *flat)

    assert ranking.decide(group, "rel_rmse", one, two, difference) == -1
    assert ranking.decide(group, "rel_rmse", two, one, difference) == 1


def test_identical_pictures_tie():
    _, reference, noise = scene()
    flat = reference.reshape(-1, 3)
    for name in ("rel_rmse", "mae", "rel_bias"):
        for rounding in (1.0, 1.0 + 1e-7):
            assert paired.difference(name, flat * 1.1, flat * 1.1 * rounding, flat, noise.reshape(-1, 3)) == (0.0, 0.0)
    assert paired.difference("flip", flat * 1.1, flat, flat, flat) is None, "no mean over pixels"


def test_the_pixels_behind():
    truth, _, _ = scene()
    flat = [p.reshape(-1, 3) for p in (few_outliers(truth), broad(truth), truth, np.zeros_like(truth))]
    facts = disagreement.behind(*flat)
    # all of a's error is in 36 of 4096 pixels, all alike: 80 % of it in 29 of them, the worst 41 hold it all
    assert facts["a"]["worst_share"]["value"] == pytest.approx(1.0)
    assert facts["a"]["most_pixels"]["value"] == pytest.approx(29 / SIZE**2)
    assert facts["a"]["brightness"]["value"] == pytest.approx(5.0 / truth.mean())
    assert facts["b"]["worst_share"]["value"] < 0.04 and facts["b"]["most_pixels"]["value"] > 0.5
    assert facts["a_nearer"]["value"] == pytest.approx(1 - 36 / SIZE**2)
    assert facts["pixels"] == SIZE**2
    flip = {"prefer_a": ["mae"], "prefer_b": ["rel_rmse", "psnr"], "a_name": "x", "b_name": "y", "pixels": facts}
    text = disagreement.sentence(flip)
    assert text.startswith(
        "mae prefers A (x); rel_rmse, psnr prefer B (y). Of A's squared error 80 % in 0.71 % of the pixels (highlights,"
    )
    assert "100 % in the worst 1 %" in text


def test_facts_know_the_references_noise():
    truth, reference, noise = scene(sigma=0.02)
    flat = [p.reshape(-1, 3) for p in (few_outliers(truth), broad(truth), reference, noise)]
    facts = disagreement.behind(*flat)
    exact = disagreement.behind(*(p.reshape(-1, 3) for p in (few_outliers(truth), broad(truth), truth, 0 * noise)))
    for side in "ab":
        for name, fact in facts[side].items():
            low, high = fact["ci95"]
            assert low < high and low <= exact[side][name]["value"] <= high, (side, name)


def test_findings_read_the_pictures(tmp_path, flipped):
    truth, reference, noise = scene()
    made = []
    for one, image in zip(flipped, (few_outliers(truth), broad(truth)), strict=True):
        pictures = {"image": image, "reference": reference, "standard_error": noise, "mask": np.ones((SIZE, SIZE))}
        files = {name: tmp_path / f"{one['technique']}-{name}.exr" for name in pictures}
        for name, path in files.items():
            exr.write(path, pictures[name].astype(np.float32))
        made.append((one, files))
    found = findings(made)
    assert found["envelopes"] is None
    (flip,) = found["rankings"]["flips"]
    assert flip["reference_id"] == "r" and flip["pixels"]["a"]["most_pixels"]["value"] < 0.01 and "highlights" in flip["text"]
    assert findings(made[:1]) == {"causes": [], "envelopes": None, "rankings": None}
