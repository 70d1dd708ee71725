"""Claims of rendered cells: pictures made up so that the statement is known to be true, and a planted change that turns it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evalsuite.compare.regions import ORDER
from evalsuite.errors import EvalsuiteError
from evalsuite.image import exr
from evalsuite.math import cubemap, phong, sh
from evalsuite.plan import load_report, report_path
from evalsuite.report import claims
from evalsuite.report.claims import constant, faces, softness, speed, views
from evalsuite.report.claims.verdict import FAILS, HOLDS, LIMITS, UNTESTED
from evalsuite.report.figures import sphere_view
from evalsuite.report.figures.rendered import Rendered
from evalsuite.scene import builtin
from evalsuite.stand_ins import cells_of


class Run:
    """Cells as results.json has them, and their pictures."""

    def __init__(self, directory):
        self.directory, self.cells = directory, []
        (directory / "results.json").write_text(json.dumps({"host": {"gl_renderer": "made up"}}), "utf-8")

    def add(self, technique, target="unoccluded", pictures=(), scene="sphere", parameters=(), **fields):
        number = len(self.cells)
        images = {}
        for name, picture in dict(pictures).items():
            images[name] = f"{number}-{name}.exr"
            exr.write(self.directory / images[name], np.asarray(picture, np.float32))
        cell = {"id": str(number), "scene": scene, "technique": technique, "target": target, "status": "scored", "message": "",
                "parameters": dict(parameters), "all_parameters": dict(parameters), "images": images, **fields}  # fmt: skip
        self.cells.append(cell)
        return cell

    def rendered(self):
        return Rendered(self.directory, self.cells)


@pytest.fixture
def run(tmp_path):
    return Run(tmp_path)


def _reflections(width=64):
    normal, to_view, hit = sphere_view.rays(width)
    return phong.reflect(to_view, normal), hit


def _smooth(cube, r):
    """A wide lobe about r, by degree 2."""
    return sh.irradiance(sh.project_cube(cube.levels[0]), r) / np.pi


@pytest.mark.parametrize(
    ("box", "across", "truth", "verdict"),
    [
        ("faces", "mean", "smooth", HOLDS),
        ("smooth", "mean", "smooth", LIMITS),
        ("turned", "mean", "smooth", LIMITS),
        ("faces", "mean", "faces", LIMITS),  # walls along the axes: Mitsuba has the pattern too
        ("faces", "faces", "smooth", LIMITS),
        ("smooth", "smooth", "smooth", FAILS),
    ],
)
def test_faces_show_where_a_picture_keeps_to_six_values(run, monkeypatch, box, across, truth, verdict):
    monkeypatch.setattr(faces, "TURNS", 40)
    r, hit = _reflections()
    names = ("office", "cathedral", "sunsky", "sh2", "overcast")
    for name, turn in zip(names, Rotation.random(len(names), random_state=3), strict=True):
        cube = sphere_view.cube(name, 32)
        made = {
            "faces": cube.bilinear(r, cube.max_level),
            "turned": cube.bilinear(turn.apply(r.reshape(-1, 3)), cube.max_level).reshape(r.shape),
            "smooth": _smooth(cube, r),
            "mean": np.broadcast_to(cube.levels[-1].mean((0, 1, 2)), r.shape),
        }
        common = {"reference": made[truth], "mask": np.repeat(hit[..., None] * 1.0, 3, -1)}
        for technique, picture in ((faces.BOX, made[box]), (faces.ACROSS, made[across])):
            run.add(technique, pictures={"image": picture, **common}, parameters={"env": name})
    found = faces.show(run.rendered())
    assert found.verdict == verdict, found


def test_a_slope_over_the_sphere_knows_no_faces():
    """A function of degree 1 has as much variance between the faces of any cube."""
    r, hit = _reflections()
    slope = np.repeat((r @ np.array([0.2, 0.7, -0.4]))[..., None], 3, -1)
    assert abs(faces._pattern(slope, hit)) < 0.02


def test_hard_faces_show_more_than_blended_ones():
    r, hit = _reflections()
    cube = sphere_view.cube("office", 32)
    blended = faces._pattern(cube.bilinear(r, cube.max_level), hit)
    stepped = faces._pattern(cube.levels[-1][cubemap.direction_to_face(r)[0], 0, 0], hit)
    assert stepped > blended > 0.05


def _timed(run, times):
    """times: technique → parameter value → ms a map."""
    for env in range(6):
        for technique, by_exponent in times.items():
            for exponent, ms in by_exponent.items():
                jitter = 1.0 + 0.02 * np.sin(3 * env + len(technique) + exponent)
                if env == 0:  # programs are compiled, which is not to be counted
                    jitter = 50.0 if technique == speed.PREFILTER and exponent == max(by_exponent) else 1.0
                cost = {"gpu_ms": 1.0, "prepare_ms": ms * jitter - 1.0}
                run.add(technique, parameters={"env": f"map {env}", "exponent": exponent}, cost=cost)
    return run.rendered()


@pytest.mark.parametrize(("slow", "verdict"), [(800.0, HOLDS), (90.0, LIMITS), (30.0, LIMITS), (10.0, FAILS)])
def test_the_faster_pass_by_times_counted_for_every_frame(run, monkeypatch, slow, verdict):
    cells = _timed(run, {speed.PREFILTER: {225: slow}, "glossy-boxmip": {225: 30.0}, "kautz-combined": {225: 30.0}})
    found = speed.single_pass(cells)
    assert found.verdict == verdict and found.numbers["ratio"]["glossy-boxmip"]["value"] == pytest.approx(slow / 30, rel=0.1)
    # Without the preparation all techniques cost the same, and nothing is faster.
    monkeypatch.setattr(speed, "frame_ms", lambda cell: cell["cost"]["gpu_ms"])
    assert speed.single_pass(cells).verdict == LIMITS


@pytest.mark.parametrize(("growth", "verdict"), [(0.3, HOLDS), (0.0, LIMITS), (-0.3, FAILS)])
def test_narrower_lobes_cost_more_or_not(run, growth, verdict):
    cells = _timed(run, {speed.PREFILTER: {n: 100.0 * n**growth for n in speed.RATES}})
    found = speed.frame_rates(cells)
    assert found.verdict == verdict, found
    assert found.numbers["last_over_first"]["value"] == pytest.approx(50**growth, rel=0.1)


@pytest.mark.parametrize(
    ("one", "first", "verdict"), [(1.02, 1.6, HOLDS), (1.02, 1.0, LIMITS), (1.6, 1.6, FAILS), (1.25, 1.6, LIMITS)]
)
def test_one_map_serves_all_views_or_not(run, one, first, verdict):
    for env in ("office", "cathedral"):
        for azimuth in (0, 90, 180, 270):
            at = {"env": env, "azimuth": azimuth}
            made = 0.02 * (1 + 0.3 * np.sin(azimuth))
            factors = {("mirror-sphere", ()): 1.0, ("mirror-paraboloid", ()): one}
            if azimuth:
                factors["mirror-sphere", (("view", views.FIRST),)] = first
            for (technique, view), factor in factors.items():
                wobble = 1.0 + 0.03 * np.cos(azimuth + len(technique) + 5 * len(view))
                metric = {"value": made * factor * wobble, "ci95": [0.0, 1.0]}
                run.add(technique, parameters={**at, **dict(view)}, metrics={"rel_rmse": metric})
    found = views.one_map(run.rendered())
    assert found.verdict == verdict, found


@pytest.mark.parametrize(
    ("drawn", "glossy", "matte", "verdict"),
    [(1.0, 0.0, 0.0, HOLDS), (1.0, 0.4, 0.0, LIMITS), (1.0, 0.4, 0.4, FAILS), (1.01, 0.0, 0.0, FAILS)],
)
def test_a_constant_environment_is_exact_or_not(run, drawn, glossy, matte, verdict):
    for technique, name, bias in (("glossy-mcguire", "specular_reflectance", glossy), ("diffuse-topmip", "reflectance", matte)):
        metric = {"rel_bias": {"value": bias, "ci95": [bias - 1e-3, bias + 1e-3]}}
        picture = np.full((8, 8, 3), 0.5 * drawn)
        run.add(technique, parameters={name: (0.5, 0.5, 0.5)}, mean_image=0.5 * drawn, metrics=metric,
                pictures={"image": picture, "mask": np.ones((8, 8, 3))})  # fmt: skip
    found = constant.exact(run.rendered())
    assert found.verdict == verdict, found


def _border(width, size=64):
    """Lit at one side, in shadow at the other, a straight ramp of this width [pixels] between."""
    across = np.clip((np.arange(size) - size / 2 + 0.5) / width + 0.5, 0.0, 1.0)
    return np.broadcast_to(across[None, :, None], (size, size, 3))


@pytest.mark.parametrize(("width", "verdict"), [(14.0, HOLDS), (10.0, LIMITS), (7.0, FAILS), (30.0, LIMITS)])
def test_softness_is_the_ratio_of_widths_freed_of_noise(run, width, verdict):
    rng, sigma = np.random.default_rng(0), 0.03
    sets = np.full((64, 64, 1), 1 << ORDER.index("penumbra"), int)
    sets[:12] |= 1 << ORDER.index("silhouette")
    for scene in ("three-boxes", "column"):
        for target in ("direct", "discs-shadowed", "discs"):
            truth = _border(10.0 if target == "direct" else width)
            noisy = truth + sigma * rng.standard_normal(truth.shape)
            seen = _border(width).copy()
            seen[:10] += 5.0 * rng.standard_normal((10, 1, 1))  # another surface's edges are no shadow's
            run.add("shadow-wedges", target, scene=scene, parameters={"env": "cathedral"}, pictures={
                "image": seen, "reference": noisy, "standard_error": np.full_like(truth, sigma), "regions": sets,
            })  # fmt: skip
    found = softness.softer(run.rendered())
    assert found.verdict == verdict, found
    for widths in found.numbers["width_over_truth"].values():
        whole, flat, wedges = (widths[name] for name in (softness.WHOLE, "flat discs", "wedges"))
        assert whole["value"] == pytest.approx(width / 10, rel=0.08) and flat["value"] == pytest.approx(width / 10, rel=0.12)
        assert whole["ci95"][0] < width / 10 * 1.02 and whole["ci95"][1] > width / 10 * 0.98
        assert wedges["value"] == pytest.approx(1.0, abs=0.12)


def test_noise_alone_is_no_border(run):
    """Were the reference's noise not taken off, a flat reference would seem sharp and any picture soft."""
    rng, flat = np.random.default_rng(1), np.ones((64, 64, 3))
    noisy = flat + 0.05 * rng.standard_normal(flat.shape)
    left = softness._squared_gradient(noisy, np.full_like(flat, 0.05))[1:-1, 1:-1].mean()
    assert abs(left) < 0.1 * softness._squared_gradient(noisy, None)[1:-1, 1:-1].mean()


def test_a_cell_without_a_score_is_its_own_claims_trouble(run):
    run.add("glossy-mcguire", parameters={"env": "furnace"})
    run.cells[0] |= {"status": "failed", "message": "no such thing"}
    found = claims.check(claims.CLAIMS["003-constant"], {}, run.rendered())
    assert found["verdict"] == UNTESTED and "no such thing" in found["why"] and found["cells"] == ["0"]


def test_every_rendered_claim_has_its_cells_and_no_cells_are_left():
    folder = builtin.reports_directory() / "claims"
    rendered = {claim.id for claim in claims.CLAIMS.values() if claim.rendered}
    assert {path.stem for path in folder.glob("*.toml")} == rendered
    for name in rendered:
        cells, _ = cells_of(folder / f"{name}.toml", {})
        assert len(cells) > 4 and load_report(str(folder / f"{name}.toml")).title
    with pytest.raises(EvalsuiteError, match="report"):
        report_path(sorted(rendered)[0])  # no report of its own
