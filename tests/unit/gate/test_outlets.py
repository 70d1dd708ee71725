"""JUnit XML, the Markdown summary and GitHub's annotations, of a check with every verdict in it."""

from __future__ import annotations

import re
import xml.etree.ElementTree as xml

import pytest

from evalsuite.gate import outlets
from evalsuite.gate.verdict import VERDICTS

NASTY = "sc|ene/<b>&\"'`x`*_[a](b)~#/p=1%\r\n::error::é\x00\x1b/direct"


def row(verdict: str, identity: str, relative: float | None = None, status: str = "scored") -> dict:
    metric = {"value": 0.05, "ci95": [0.049, None]}
    share = None if relative is None else {"value": relative, "ci95": [relative - 0.1, None]}
    return {
        "id": identity, "technique": "mine", "target": "direct", "status": status, "verdict": verdict,
        "passed": VERDICTS[verdict], "reason": f"because of {identity}", "basis": "paired", "relative": share, "wall_s": 1.5,
        "metrics": {"rel_rmse": {"before": metric, "now": None}}, "changes": [{"what": "seed", "a": 0, "b": 1}],
    }  # fmt: skip


def check(*rows: dict) -> dict:
    return {
        "report": "small", "baseline": "small.baseline.json", "created": "2026-01-01T12:00:00+00:00", "cells": list(rows),
        "host": {"gl_renderer": "llvmpipe", "versions": {"numpy": "2"}}, "passed": all(r["passed"] for r in rows),
        "counts": {v: sum(r["verdict"] == v for r in rows) for v in VERDICTS}, "bless": "evalsuite bless small",
    }  # fmt: skip


@pytest.fixture
def every():
    return check(*(row(v, f"{v}/mine/default/direct") for v in reversed(VERDICTS)), row("further", NASTY, 2.0),
                 row("unchanged", "skip", status="skipped"))  # fmt: skip


def test_junit_is_as_servers_read_it(every):
    """Structure and counts of the usual schema (Jenkins' xUnit plugin: testsuites/testsuite/properties, testcase)."""
    text = outlets.junit(every)
    root = xml.fromstring(text.encode())
    assert root.tag == "testsuites" and [child.tag for child in root] == ["testsuite"]
    suite = root[0]
    assert suite[0].tag == "properties" and {c.tag for c in suite[1:]} == {"testcase"}
    cases = suite.findall("testcase")
    assert len(cases) == len(every["cells"]) == int(suite.get("tests")) == int(root.get("tests"))
    for kind, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
        assert int(suite.get(kind)) == len(suite.findall(f"testcase/{tag}"))
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d", suite.get("timestamp"))
    for case, cell in zip(cases, every["cells"], strict=True):
        assert float(case.get("time")) == 1.5 and case.get("classname") == "evalsuite.small.mine"
        tags = [child.tag for child in case]
        assert (tags in (["failure"], ["error"])) == (not cell["passed"]), cell["verdict"]
        assert (tags == ["error"]) == (cell["verdict"] == "failed") and (tags == ["skipped"]) == (cell["id"] == "skip")
    assert {p.get("name"): p.get("value") for p in suite.iter("property")}["gl_renderer"] == "llvmpipe"


def test_junit_holds_any_name(every):
    cases = xml.fromstring(outlets.junit(every).encode()).findall("testsuite/testcase")
    names = [case.get("name") for case in cases]
    assert NASTY.replace("\x00", "\ufffd").replace("\x1b", "\ufffd") in [
        name.replace("\r\n", "\n").replace("\n", "\r\n") for name in names
    ]


def test_summary_has_the_ten_worst_first():
    rows = [row("further", f"cell{k}", float(k)) for k in range(20)] + [row("unchanged", "same"), row("failed", "broken")]
    text = outlets.markdown(check(*rows))
    lines = [line for line in text.splitlines() if line.startswith("| ")][1:]
    assert [re.findall(r"cell\d+|broken", line)[0] for line in lines] == ["broken", *(f"cell{k}" for k in range(19, 10, -1))]
    assert "same" not in text and "… and 11 more" in text
    assert "failed: 22 cells, 1 failed, 20 further, 1 unchanged" in text
    assert "| 5 % |  | +1.9e+03 [+1.89e+03, …] % |" in text


def test_summary_of_a_pass_is_a_line():
    text = outlets.markdown(check(row("unchanged", "a")))
    assert text.strip() == "### ✓ evalsuite check small: passed: 1 cell, 1 unchanged"
    assert "evalsuite bless small" in outlets.markdown(check(row("closer", "a", -0.5)))


def test_summary_is_no_markup(every):
    markdown_it = pytest.importorskip("markdown_it")
    html = markdown_it.MarkdownIt("gfm-like", {"linkify": False}).render(outlets.markdown(every))
    assert "<b>" not in html and "<em>" not in html and "<a " not in html and "<code>x" not in html
    cells = [line for line in html.splitlines() if line.startswith("<td")]
    assert len(cells) % 6 == 0, "no name makes a column"


def test_annotations_are_one_line_each_and_escaped(every):
    lines = outlets.annotations(every)
    assert len(lines) == 10 and not any(set("\r\n") & set(line) for line in lines)
    nasty = next(line for line in lines if "sc|ene" in line)
    title, message = re.fullmatch(r"::error title=([^:,]*)::(.*)", nasty).groups()
    assert "p=1%25%0D%0A%3A%3Aerror%3A%3A" in title and "%0D%0A::error::" in message
    kinds = {line.split("%3A")[0].split("title=")[1]: line.split()[0] for line in lines}
    assert kinds["failed"] == "::error" and kinds["closer"] == "::notice" and kinds["inconclusive"] == "::warning"
