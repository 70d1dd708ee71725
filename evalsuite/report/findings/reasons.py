"""Findings on what errors come from: the assumption that costs most, and parameters that would have been better."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from evalsuite.compare.headroom_pool import ABOUT_H, ABOUT_R
from evalsuite.report.findings.parts import LINES, Finding, Part, capital, count_of, name_of
from evalsuite.report.numbers import measured


def costliest(results: Mapping) -> Iterator[Finding]:
    """Which assumption costs a technique most; the headline is the costliest by its own error, where its first place is sure."""
    cells = {cell["id"]: cell for cell in results.get("cells", [])}
    lines, heads = [], []
    for row in results.get("causes") or []:
        if not row["causes"]:
            continue
        first, others = row["causes"][0], row["causes"][1:]
        sure = all(first["fraction"]["ci95"][0] > other["fraction"]["ci95"][1] for other in others)
        place = first["largest"]["cell"]
        rung = next((r for r in cells.get(place, {}).get("ledger") or [] if r["rung"] == first["rung"]), None)
        share = f"{measured(first['fraction'], '%')} of the squared error of {row['technique']}"
        over = f", mean over {count_of(row['cells'], 'cell')}"
        if not sure:
            second = others[0]
            lines.append(((f"{row['technique']}: undecided between {first['rung']} ({measured(first['fraction'], '%')}) and "
                           f"{second['rung']} ({measured(second['fraction'], '%')}){over}.", ""),))  # fmt: skip
            continue
        where = name_of(cells[place]) if place in cells else (place, place)
        words: tuple[Part, ...] = ((f"{capital(first['rung'])}: {share}{over}; look at ", ""), where)
        if rung:
            words += ((f", where it is a relative RMSE of {measured(rung['rel_rmse'], '%')}", ""),)
        lines.append((*words, (".", "")))
        heads.append((rung["rel_rmse"]["value"] or 0.0 if rung else 0.0, lines[-1]))
    if heads:
        yield Finding("What costs most", max(heads, key=lambda h: h[0])[1], 75.0, tuple(lines[:LINES]))
    elif lines:
        yield Finding("What costs most", lines[0], 40.0, tuple(lines[:LINES]), undecided=True)


def constants(results: Mapping) -> Iterator[Finding]:
    """The best parameter of each technique beside the published one; McGuire's constant of the level for each lobe first."""
    pools = (results.get("headroom_summary") or {}).get("pools", [])
    lobes = {ABOUT_H: "about h", ABOUT_R: "about r"}
    named = [p for p in pools if p["technique"] in lobes and p["parameter"] == "lod_offset"]
    for some, title, weight in (
        (named, "Best constant in McGuire's level", 90.0),
        ([p for p in pools if p not in named], "Best parameter beside the published one", 60.0),
    ):
        lines, sure = [], []
        for pool in some:
            if pool["best"]["value"] is None and not pool["open_cells"]:
                continue  # whole numbers are not pooled
            lobe = f", lobe {lobes[pool['technique']]}" if pool in named else ""
            words, decided = _constant(pool)
            lines.append(((f"{pool['technique']}{lobe}: {words}", "#headroom"), (".", "")))
            sure.append(decided)
        if lines and some is named:  # both lobes in one sentence
            parts = tuple(part for k, line in enumerate(lines) for part in ((("", ""), (" ", ""))[k > 0], *line))
            yield Finding(title, parts, weight, undecided=not any(sure))
        elif lines:
            head = next((line for line, decided in zip(lines, sure, strict=True) if decided), lines[0])
            yield Finding(title, head, weight if any(sure) else 30.0, tuple(lines), undecided=not any(sure))


def _constant(pool: Mapping) -> tuple[str, bool]:
    """(the best value less the published one in words, whether it differs from it beyond doubt)."""
    best, unit = pool["best"], pool["unit"]
    if best["value"] is None or None in best["ci95"]:
        return (
            f"undecided, no best {pool['parameter']} within what was searched, in {pool['open_cells']} of {pool['cells']} cells",
            False,
        )
    low, high = best["ci95"]
    maps = f"over {count_of(len(best['by_map']), 'map')}"
    value = f"{measured(best)} {unit} beside the published {pool['parameter']}, {maps}"
    if low <= 0 <= high:
        return f"undecided, as its interval holds the published choice: {value}", False
    gain = (pool.get("best_constant") or {}).get("rmse_ratio")
    return value + (f"; the best single constant leaves {measured(gain, '%')} of the RMSE" if gain else ""), True
