"""Finding an LLVM: bad candidates cost a child process, never ours."""

import json
import subprocess
import sys

import pytest

from evalsuite.errors import MachineLacks
from evalsuite.reference import variants


def test_activate_is_idempotent_and_registers_the_plugins():
    mi = variants.activate()
    assert mi is variants.activate() and mi.variant() == "llvm_ad_rgb"
    assert mi.load_dict({"type": "phong"}) and mi.load_dict({"type": "unoccluded"})


def test_bad_libraries_are_passed_over(tmp_path, monkeypatch):
    monkeypatch.setenv("EVALSUITE_CACHE", str(tmp_path))
    good = variants.working_library()
    junk = tmp_path / "libLLVM-99.so"
    junk.write_bytes(b"not a library")
    monkeypatch.setattr(variants, "library_paths", lambda: iter([(junk, "test"), (variants.Path(good.path), "test")]))
    first, second = variants.candidates()
    assert not first.usable and first.verdict
    assert second.usable and int(second.version.split(".")[0]) >= 17
    assert variants.working_library().path == good.path


def test_verdicts_are_remembered(tmp_path, monkeypatch):
    monkeypatch.setenv("EVALSUITE_CACHE", str(tmp_path))
    good = variants.working_library()
    assert json.loads((tmp_path / "llvm.json").read_text())
    monkeypatch.setattr(variants, "_probe", lambda path: pytest.fail("probed again"))
    assert variants.working_library() == good
    (tmp_path / "llvm.json").write_text("{ damaged")
    monkeypatch.setattr(variants, "_probe", lambda path: variants.Candidate(str(path), "", True, "renders", "0"))
    assert variants.working_library().version == "0"


def test_no_library_says_how_to_get_one(tmp_path, monkeypatch):
    monkeypatch.setattr(variants, "library_paths", lambda: iter([]))
    with pytest.raises(MachineLacks, match="libllvm19") as caught:
        variants.working_library()
    assert caught.value.exit_code == 3 and "\n" not in str(caught.value)


def test_probe_says_what_there_is():
    facts = variants.probe()
    assert facts["variants"] == ["llvm_ad_rgb"] and facts["fix"] == ""
    assert facts["llvm"]["path"] in {c["path"] for c in facts["candidates"] if c["usable"]}
    assert facts["mitsuba"] and facts["drjit"] and facts["cpu"]


def test_a_fresh_process_is_quiet_and_limits_its_threads():
    code = (
        "from evalsuite.reference.variants import activate\n"
        "mi = activate(1)\nimport drjit as dr\nassert dr.thread_count() == 1, dr.thread_count()\n"
        "try:\n    mi.load_dict({'type': 'nonsense'})\nexcept RuntimeError:\n    pass\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
