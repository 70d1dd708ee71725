"""Report definition and command line → cells."""

import json

import pytest

from evalsuite import plan as planning
from evalsuite.errors import EvalsuiteError
from evalsuite.plan import QUALITY, Choice, load_report, parse_parameters

plan = planning.plan

OWN = '<scene version="3.0.0"><bsdf type="diffuse" id="clay"/></scene>'
SUBJECT = OWN.replace("clay", "subject")


@pytest.fixture
def accuracy():
    return load_report("accuracy")


def test_quality_is_as_promised():
    assert {name: error for name, (error, _) in QUALITY.items()} == {"draft": 0.02, "standard": 0.005, "publication": 0.001}


def test_ids_say_scene_technique_parameters_target(accuracy):
    ids = [cell.id for cell in plan(accuracy)]
    assert len(ids) == len(set(ids)) > 30
    assert "sphere/glossy-mcguire/env=office,exponent=500/unoccluded" in ids
    assert "still-life/diffuse-sh9/default/path" in ids
    assert all(len(i.split("/")) == 4 for i in ids)


def test_globs_sweeps_and_targets(accuracy):
    sweep = parse_parameters(["exponent=8, 16.5", "face_size=64"])
    choice = Choice(["torus"], ["glossy-mcg*", "glossy-boxmip"], None, ["direct"], sweep)
    assert [c.id for c in plan(accuracy, choice)] == [
        f"torus/{t}/exponent={e},face_size=64/direct" for t in ("glossy-boxmip", "glossy-mcguire") for e in ("8", "16.5")
    ]
    assert {c.technique for c in plan(accuracy, Choice(techniques=["mirror-*"]))} >= {"mirror-cube"}


def test_a_technique_outside_the_report_runs_all_the_same(tmp_path):
    (tmp_path / "r.toml").write_text('[[group]]\nscenes = ["torus"]\ntechniques = ["diffuse-sh9"]\n')
    cells = plan(load_report(str(tmp_path / "r.toml")), Choice(techniques=["mirror-cube"]))
    assert [c.id for c in cells] == ["torus/mirror-cube/default/unoccluded"]


def test_a_technique_has_its_own_target_unless_report_or_user_name_one(tmp_path):
    group = '[[group]]\nscenes = ["sphere"]\ntechniques = ["npr-sketch", "diffuse-sh9"]\n'
    (tmp_path / "r.toml").write_text(group)
    (tmp_path / "s.toml").write_text(group + 'targets = ["path"]\n')
    own, named = (load_report(str(tmp_path / name)) for name in ("r.toml", "s.toml"))
    assert [c.target for c in plan(own)] == ["lookup", "unoccluded"]
    assert [c.target for c in plan(named)] == ["path", "path"]
    assert [c.target for c in plan(own, Choice(targets=["direct"]))] == ["direct", "direct"]


def test_a_scene_without_a_subject_keeps_its_materials(accuracy, tmp_path):
    """The report sweeps the exponent of its subject; a user's own materials are the truth unless he gives -p."""
    (tmp_path / "own.xml").write_text(OWN)
    (tmp_path / "bound.xml").write_text(SUBJECT)
    own, bound = (plan(accuracy, Choice([str(tmp_path / f"{n}.xml")], ["glossy-mcguire"])) for n in ("own", "bound"))
    assert {c.id for c in own} == {"own/glossy-mcguire/default/unoccluded"}
    assert {"bound/glossy-mcguire/exponent=20/unoccluded", "bound/glossy-mcguire/exponent=500/unoccluded"} <= {
        c.id for c in bound
    }
    forced = plan(accuracy, Choice([str(tmp_path / "own.xml")], ["glossy-mcguire"], parameters={"exponent": (7,)}))
    assert {(c.parameters["exponent"], c.forced) for c in forced} == {(7, frozenset({"exponent"}))}


def test_two_scenes_of_one_name_stay_two(accuracy, tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "s.xml").write_text(OWN)
    cells = plan(
        accuracy, Choice([str(tmp_path / "a" / "s.xml"), str(tmp_path / "b" / "s.xml")], ["diffuse-sh9"], targets=["path"])
    )
    assert [c.id.split("/")[0] for c in cells] == ["s", "b-s"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("title = 3\n[[group]]\nscene = ['torus']", "unknown key 'scene'"),
        ("[[group]]\nscenes = 'torus'", "a list of names"),
        ("titel = 'x'\n[[group]]", "unknown key 'titel'"),
        ("title = 'x'", r"no \[\[group\]\]"),
        ("not toml", "mend the file"),
    ],
)
def test_a_bad_definition_says_where(tmp_path, text, expected):
    (tmp_path / "r.toml").write_text(text)
    with pytest.raises(EvalsuiteError, match=expected) as caught:
        load_report(str(tmp_path / "r.toml"))
    assert "r.toml" in str(caught.value)


def test_choice_survives_json():
    choice = Choice(("a.xml",), ("my.glsl", "glossy-*"), "office", ("direct",), {"exponent": (1, 2.5), "per": ("pixel",)}, True)
    assert planning.choice_from_json(json.loads(json.dumps(planning.choice_to_json(choice)))) == choice
    assert planning.choice_to_json(Choice()) == {} and planning.choice_from_json({}) == Choice()
