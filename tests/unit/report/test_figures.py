"""What the figures show, against closed forms."""

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.report import figures
from evalsuite.report.figures import paraboloid, sampling_rates


@pytest.fixture(scope="module")
def rates():
    return sampling_rates.data()


def test_every_id_names_a_paper_and_a_figure():
    assert all(key == f.id and f.paper and f.title for key, f in figures.FIGURES.items())
    assert [f.id for f in figures.choose([])] == list(figures.FIGURES)
    assert [f.id for f in figures.choose(["002-fig3"])] == ["002-fig3"]
    with pytest.raises(EvalsuiteError, match="did you mean '002-fig3'"):
        figures.choose(["002-fig33"])


def test_ratios_of_texels_approach_the_papers(rates):
    """The largest texel has its corner at a face's centre, the smallest at a face's corner: first order in 1/w off 3√3, 4."""
    ratios = rates["measured"]["solid_angle_largest_over_smallest"]
    for name, limit in (("cube", 3 * np.sqrt(3)), ("paraboloid", 4.0)):
        errors = [1 - ratio / limit for ratio in ratios[name].values()]
        assert all(errors) and errors == sorted(errors, reverse=True) and 0 < errors[-1] < 0.003
        np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 4, rtol=0.25)  # four times the texels along an edge
    assert all(ratio == pytest.approx(1, abs=1e-9) for ratio in ratios["sphere"].values())


@pytest.mark.parametrize("name", ["sphere", "cube", "paraboloid"])
def test_solid_angle_is_one_over_the_product_of_the_linear_rates(rates, name):
    one, mean = rates["maps"][name], rates["measured"]["mean_solid_angle_sr"]
    area = 1 / np.degrees(one["rates"]).prod(-1)
    inner = one["theta"] < 150  # near a sphere map's rim the steps grow longer than their own change
    np.testing.assert_allclose(area[inner], (one["omega"] * mean)[inner], rtol=0.02)


def test_linear_rates_are_the_closed_forms(rates):
    maps, per_degree = rates["maps"], np.radians(1)
    half = np.radians(maps["sphere"]["theta"]) / 2
    radius = sampling_rates.FACE * np.sqrt(6 / np.pi)
    inner = maps["sphere"]["theta"] < 150
    expected = per_degree * 0.5 * radius * np.stack([np.cos(half), 1 / np.cos(half)], -1)
    np.testing.assert_allclose(maps["sphere"]["rates"][inner], expected[inner], rtol=0.01)
    rho = np.tan(np.radians(maps["paraboloid"]["theta"]) / 2)
    rho = np.minimum(rho, 1 / rho)
    radius = sampling_rates.FACE * np.sqrt(3 / np.pi)
    for k in (0, 1):  # a conformal map: the same in every direction
        np.testing.assert_allclose(maps["paraboloid"]["rates"][:, k], per_degree * 0.5 * radius * (1 + rho**2), rtol=0.02)


def test_a_paraboloids_texels_follow_cos4():
    data = paraboloid.data()
    np.testing.assert_allclose(data["ratio"], np.cos(data["theta"] / 2) ** 4, atol=1e-4)
    assert data["measured"]["sum_of_both_maps_over_4pi"] == pytest.approx(1, abs=1e-12)
    assert data["measured"]["ratio_centre_to_rim"] == pytest.approx(4, rel=0.006)
    assert np.degrees(data["theta"].max()) > 89


def test_a_figure_drawn_again_is_the_same_file(tmp_path):
    figure = figures.FIGURES["002-fig3"]
    (first, _), (second, _) = (figures.make(figure, tmp_path / name) for name in ("a", "b"))
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes() == other.read_bytes() and one.stat().st_size > 200


def test_headroom_figures_integrate_lobes_and_find_least_points():
    from evalsuite.report.figures import headroom_mcguire, sphere_view

    x = np.linspace(-2, 2, 9)
    assert sphere_view.least(x, (x - 0.3) ** 2) == pytest.approx(0.3)
    assert sphere_view.least(x, x) == -2.0
    normal, to_view, mask = sphere_view.rays(32)
    assert 0.5 < mask.mean() < 0.75 and (normal[mask] * to_view[mask]).sum(-1).min() > 0
    facing = np.unravel_index(np.argmax(np.where(mask, (normal * to_view).sum(-1), -1.0)), mask.shape)
    n, v = normal[facing][None], to_view[facing][None]
    weights = headroom_mcguire.truths(n, v, 50.0)
    assert weights["r"].sum() == pytest.approx(1.0, abs=2e-3)  # the whole lobe, uncut
    assert weights["h, albedo 1"].sum() == pytest.approx(1.0, abs=1e-5)
    assert weights["h"].sum() == pytest.approx(1.0, abs=0.05)  # (s + 8)/8π is the albedo's own approximation there
