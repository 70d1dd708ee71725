"""The workflow files in docs/ci: they parse, have what their servers ask for, and name commands and options that exist."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
import typer
import yaml

from evalsuite.cli import app

CI = Path(__file__).resolve().parents[3] / "docs" / "ci"


def load(name: str) -> dict:
    return yaml.safe_load((CI / name).read_text(encoding="utf-8"))


def github_steps() -> list[dict]:
    [job] = load("github.yml")["jobs"].values()
    return job["steps"]


def lines(name: str) -> list[str]:
    if name == "github.yml":
        return [step["run"] for step in github_steps() if "run" in step]
    job = load(name)["gate"]
    return job["before_script"] + job["script"]


def cached(name: str) -> tuple[str, ...]:
    """Paths that are kept where the gate fails, too."""
    if name == "github.yml":
        kept = [step for step in github_steps() if step.get("uses", "").startswith("actions/cache/save")]
        return tuple(step["with"]["path"] for step in kept if step["if"] == "always()")
    return tuple(path for one in load(name)["gate"]["cache"] if one.get("when") == "always" for path in one["paths"])


def test_github_has_its_parts():
    data = load("github.yml")
    assert set(data) == {"name", True, "permissions", "jobs"}  # YAML reads `on` as true, and so does GitHub's own
    [job] = data["jobs"].values()
    assert {"runs-on", "steps"} <= set(job)
    assert all(("uses" in step) != ("run" in step) for step in job["steps"])
    kept = [step for step in job["steps"] if "upload-artifact" in step.get("uses", "")]
    assert kept and kept[0]["if"] == "always()", "a failed gate shows its page"


def test_gitlab_has_its_parts():
    [job] = load("gitlab.yml").values()
    assert {"image", "script", "artifacts"} <= set(job)
    assert job["artifacts"]["when"] == "always" and job["artifacts"]["reports"]["junit"] == "gate.xml"


@pytest.mark.parametrize("name", ["github.yml", "gitlab.yml"])
def test_commands_exist(name):
    program, typed = typer.main.get_command(app), 0
    for line in lines(name):
        for command in line.split("&&"):
            first, *words = shlex.split(command)
            if first != "evalsuite":
                continue
            context = program.commands[words[0]].make_context(words[0], words[1:])
            assert context.params["report"] == "reports/gate.toml"
            assert (str(context.params["junit"]), str(context.params["summary"])) == ("gate.xml", "gate.md")
            assert str(context.params["history"]).startswith(cached(name)), "it stays from run to run"
            typed += 1
    assert typed == 1
