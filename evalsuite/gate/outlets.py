"""Where a check is seen: JUnit XML, a Markdown summary, GitHub's annotations. Each is text made from check.json alone."""

from __future__ import annotations

import re
import xml.etree.ElementTree as xml
from collections.abc import Mapping

from evalsuite.gate.verdict import VERDICTS

#: Most rows of a summary, and most annotations (GitHub shows ten of a kind in a step).
WORST = 10
MARKS = {"unchanged": "=", "tolerated": "=", "closer": "✓", "inconclusive": "≈"}
_ILLEGAL = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # what XML 1.0 cannot hold


def worst(check: Mapping) -> list[Mapping]:
    """Cells that are not unchanged, the worst first: by verdict, then by how much the squared error grew."""
    places = list(VERDICTS)

    def key(row: Mapping) -> tuple[int, float]:
        return places.index(row["verdict"]), -((row["relative"] or {}).get("value") or 0.0)

    return sorted((row for row in check["cells"] if row["verdict"] != "unchanged"), key=key)


def headline(check: Mapping) -> str:
    """The counts in a sentence."""
    counts, total = check["counts"], len(check["cells"])
    parts = [f"{counts[name]} {name}" for name in VERDICTS if counts[name]]
    return (
        f"{'passed' if check['passed'] else 'failed'}: {total} {'cell' if total == 1 else 'cells'}, {', '.join(parts) or 'none'}"
    )


def junit(check: Mapping) -> str:
    """A test suite with a test case a cell, as CI servers read it (the schema of Jenkins' xUnit plugin)."""
    cells = check["cells"]
    failures = sum(not row["passed"] and row["verdict"] != "failed" for row in cells)
    errors = sum(row["verdict"] == "failed" for row in cells)
    skipped = [row["passed"] and row["status"] == "skipped" for row in cells]
    numbers = {"tests": len(cells), "failures": failures, "errors": errors}
    root = xml.Element("testsuites", _strings({"name": "evalsuite", **numbers}))
    suite = xml.SubElement(
        root,
        "testsuite",
        _strings({"name": check["report"], **numbers, "skipped": sum(skipped), "timestamp": check["created"][:19]}),
    )
    properties = xml.SubElement(suite, "properties")
    for name, value in {"baseline": check["baseline"], **check["host"]}.items():
        if isinstance(value, str):
            xml.SubElement(properties, "property", _strings({"name": name, "value": value}))
    for row, skip in zip(cells, skipped, strict=True):
        names = {"classname": f"evalsuite.{check['report']}.{row['technique']}", "name": row["id"]}
        case = xml.SubElement(suite, "testcase", _strings({**names, "time": row["wall_s"] or 0}))
        if skip:
            xml.SubElement(case, "skipped", _strings({"message": row["reason"]}))
        elif not row["passed"]:
            kind = "error" if row["verdict"] == "failed" else "failure"
            found = xml.SubElement(case, kind, _strings({"message": row["reason"], "type": row["verdict"]}))
            found.text = _clean(details(row))
        elif row["verdict"] != "unchanged":
            xml.SubElement(case, "system-out").text = _clean(f"{row['verdict']}: {row['reason']}\n{details(row)}")
    xml.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + xml.tostring(root, encoding="unicode") + "\n"


def markdown(check: Mapping) -> str:
    """The summary: counts, and the ten worst in a table."""
    rows = worst(check)
    lines = [f"### {'✓' if check['passed'] else '✗'} evalsuite check {_cell(check['report'])}: {headline(check)}", ""]
    if rows:
        lines += ["| verdict | cell | rel_rmse before | now | squared error | |", "|---|---|---:|---:|---:|---|"]
    for row in rows[:WORST]:
        errors = row["metrics"].get("rel_rmse") or {}
        before, now = (_percent(errors.get(side)) for side in ("before", "now"))
        mark = MARKS.get(row["verdict"], "✗")
        lines.append(
            f"| {mark} {row['verdict']} | {_cell(row['id'])} | {before} | {now} | {change(row)} | {_cell(row['reason'])} |"
        )
    if len(rows) > WORST:
        lines += ["", f"… and {len(rows) - WORST} more that are not unchanged."]
    if check["counts"]["closer"]:
        lines += ["", f"Closer to the truth: `{_cell(check['bless'])}` keeps it so."]
    return "\n".join(lines) + "\n"


def annotations(check: Mapping) -> list[str]:
    """GitHub's workflow commands for the ten worst cells."""
    lines = []
    for row in worst(check)[:WORST]:
        kind = "error" if not row["passed"] else "warning" if row["verdict"] == "inconclusive" else "notice"
        title = _escape(f"{row['verdict']}: {row['id']}", ":,")
        lines.append(f"::{kind} title={title}::{_escape(row['reason'])}")
    return lines


def change(row: Mapping) -> str:
    """The change of the squared error over what it was [%], with its 95 % interval."""
    relative = row["relative"]
    if not relative or relative["value"] is None:
        return ""
    low, high = ("…" if end is None else f"{100 * end:+.3g}" for end in relative["ci95"])
    return f"{100 * relative['value']:+.3g} [{low}, {high}] %"


def _percent(metric: Mapping | None) -> str:
    return "" if not metric or metric["value"] is None else f"{100 * metric['value']:.3g} %"


def details(row: Mapping) -> str:
    """What a failed cell says below its reason: metrics before and now, the change of the error, what else changed."""
    errors = {name: [_number(m["before"]), _number(m["now"])] for name, m in row["metrics"].items()}
    lines = [f"{name}: {before} → {now}" for name, (before, now) in errors.items()]
    lines += [f"squared error: {change(row)} ({row['basis']})"] if change(row) else []
    lines += [f"{one['what']}: {one['a']} → {one['b']}" for one in row["changes"]]
    return "\n".join(lines)


def _number(metric: Mapping | None) -> str:
    if not metric or metric["value"] is None:
        return "–"
    low, high = ("…" if end is None else f"{end:.4g}" for end in metric["ci95"])
    return f"{metric['value']:.4g} [{low}, {high}]"


def _strings(values: Mapping) -> dict[str, str]:
    return {name: _clean(str(value)) for name, value in values.items()}


def _clean(text: str) -> str:
    return _ILLEGAL.sub("�", text)


def _cell(text: str) -> str:
    """Text in a Markdown table: nothing of it is markup."""
    text = " ".join(text.split()).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return re.sub(r"([\\`*_\[\]|~#])", r"\\\1", text)


def _escape(text: str, also: str = "") -> str:
    for char in "%\r\n" + also:
        text = text.replace(char, f"%{ord(char):02X}")
    return text
