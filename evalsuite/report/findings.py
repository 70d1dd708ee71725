"""What a run found, in words, for the top of its page: each sentence with its numbers, their 95 % intervals and where they stand.

Nothing is said that the references' noise could turn round: where intervals leave an order open, the sentence says "undecided".
Each interval is one by itself; that all of many hold at once is less sure.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from evalsuite.compare.error_map import ROUNDING
from evalsuite.compare.headroom_pool import ABOUT_H, ABOUT_R
from evalsuite.report.numbers import measured, number, plain
from evalsuite.report.where import worst

#: A piece of a sentence: words, and the cell's id or "#section" that they lead to; "" for words alone.
Part = tuple[str, str]
#: The most that stand at the top of a page, and lines below one of them.
MOST, LINES = 8, 40
ERROR = "rel_rmse"


@dataclass(frozen=True)
class Finding:
    """title: what it is about. parts: the sentence. weight: the heaviest come first. lines: what it rests on, a sentence each.
    undecided: whether noise decides."""

    title: str
    parts: tuple[Part, ...]
    weight: float
    lines: tuple[tuple[Part, ...], ...] = ()
    undecided: bool = False

    @property
    def text(self) -> str:
        return "".join(words for words, _ in self.parts)


def findings(results: Mapping) -> list[Finding]:
    """The findings of a run (as in results.json), the heaviest first, at most `MOST`."""
    found = [one for make in MAKERS for one in make(results)]
    return sorted(found, key=lambda one: -one.weight)[:MOST]


def without_score(results: Mapping) -> Iterator[Finding]:
    """Cells that failed or whose pictures do not show the same geometry: these are counted, which needs no interval."""
    cells = results.get("cells", [])
    bad = [cell for cell in cells if cell.get("status") in ("failed", "uncertified")]
    if bad:
        words = {"failed": "failed", "uncertified": "not certified"}
        count = ", ".join(
            f"{sum(c['status'] == s for c in bad)} {w}" for s, w in words.items() if any(c["status"] == s for c in bad)
        )
        lines = tuple(
            ((c["id"], c["id"]), (f": {words[c['status']]}. {c.get('message') or ''}".rstrip(), "")) for c in bad[:LINES]
        )
        parts = (
            (f"{len(bad)} of {len(cells)} cells have no score ({count}); the first is ", ""),
            (bad[0]["id"], bad[0]["id"]),
            (".", ""),
        )
        yield Finding("Cells without a score", parts, 100.0, lines)


def largest(results: Mapping) -> Iterator[Finding]:
    """The cell of the largest relative error, and where on the object that error is."""
    cells = sorted(_scored(results), key=lambda cell: -cell["metrics"][ERROR]["value"])
    if len(cells) < 2:
        return
    first, rival = cells[0], max(cells[1:], key=lambda cell: _end(cell, 1))
    error = first["metrics"][ERROR]
    parts: tuple[Part, ...] = (_name(first), (f": relative RMSE {measured(error, '%')}", ""))
    place = worst(first)
    if place:
        share = (
            f"{number(place['part'], '%', 2)} of the object's pixels, hold {measured(place['share'], '%')} of its squared error"
        )
        parts += ((f". Pixels of the {place['name']}, {share}", ""),)
    open_ = _end(first, 0) <= _end(rival, 1)
    if open_:
        beside = f" beside {measured(rival['metrics'][ERROR], '%')} of "
        parts = ((f"Undecided{beside}", ""), _name(rival), (". By the values: ", ""), *parts)
    yield Finding("Largest error", (*parts, (".", "")), 80.0, undecided=open_)


def against_each_truth(results: Mapping) -> Iterator[Finding]:
    """Best and worst technique against each reference that several share; the headline has the most rivals."""
    by_id = {cell["id"]: cell for cell in _scored(results)}
    lines, heads = [], []
    for group in (results.get("rankings") or {}).get("groups", []):
        cells = sorted((by_id[i] for i in group["cells"] if i in by_id), key=lambda cell: cell["metrics"][ERROR]["value"])
        if len(cells) < 2:
            continue
        ranks, count = group["ranks"].get(ERROR, {}), len(group["cells"])
        ends = [ranks.get(group["cells"][cells[k]["id"]]) for k in (0, -1)]
        best, most = ends[0] == [1, 1], ends[1] == [count, count]
        words = _where(group)
        sides = (*_side("best", cells[0], best), ("; ", ""), *_side("worst", cells[-1], most))
        line: tuple[Part, ...] = ((f"{words}, {count} cells: ", ""), *sides, (".", ""))
        lines.append(line)
        heads.append((best + most, count, line))
    if heads:
        decided, _, line = max(heads, key=lambda head: head[:2])
        sure = sum(head[0] == 2 for head in heads)
        tail = (f" Both ends are decided against {sure} of {len(heads)} references.", "") if len(heads) > 1 else ("", "")
        yield Finding("Best and worst against one truth", (*line, tail), 70.0, tuple(lines[:LINES]), undecided=decided == 0)


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
        over = f", mean over {_count(row['cells'], 'cell')}"
        if not sure:
            second = others[0]
            lines.append(((f"{row['technique']}: undecided between {first['rung']} ({measured(first['fraction'], '%')}) and "
                           f"{second['rung']} ({measured(second['fraction'], '%')}){over}.", ""),))  # fmt: skip
            continue
        where = _name(cells[place]) if place in cells else (place, place)
        words: tuple[Part, ...] = ((f"{_capital(first['rung'])}: {share}{over}; its largest share is in ", ""), where)
        if rung:
            words += ((f", there a relative RMSE of {measured(rung['rel_rmse'], '%')}", ""),)
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
    maps = f"over {_count(len(best['by_map']), 'map')}"
    value = f"{measured(best)} {unit} beside the published {pool['parameter']}, {maps}"
    if low <= 0 <= high:
        return f"undecided, as its interval holds the published choice: {value}", False
    gain = (pool.get("best_constant") or {}).get("rmse_ratio")
    return value + (f"; the best single constant leaves {measured(gain, '%')} of the RMSE" if gain else ""), True


def crossings(results: Mapping) -> Iterator[Finding]:
    """Where one technique overtakes another; the headline is the narrowest interval against one truth."""
    found = (results.get("envelopes") or {}).get("crossovers", [])
    decided = [one for one in found if one["decided"]]
    if not found:
        return
    if not decided:
        one = found[0]
        words = f"All {len(found)} are undecided: noise could move each out of its sweep; {_crossing(one)}"
        yield Finding("Crossovers", ((words, "#envelopes"), (".", "")), 35.0, undecided=True)
        return
    decided.sort(key=lambda one: (not one["same_truth"], (one["ci95"][1] - one["ci95"][0]) / abs(one["value"] or 1.0)))
    tail = f". {len(decided)} of {len(found)} crossovers are decided." if len(found) > 1 else "."
    lines = tuple(((_crossing(one), "#envelopes"), (".", "")) for one in decided[:LINES])
    yield Finding("Crossovers", ((_crossing(decided[0]), "#envelopes"), (tail, "")), 65.0, lines)


def _crossing(one: Mapping) -> str:
    at = ", ".join(f"{name} {plain(value)}" for name, value in one["at"].items())
    words = (
        f"along {one['axis']}, {one['better_below']} is nearer to the truth below {measured(one)}, {one['better_above']} above"
    )
    truth = "" if one["same_truth"] else ", each against its own truth"
    return _capital(f"{words} ({', '.join(filter(None, (one['scene'], one['environment'], one['target'], at)))}{truth})")


def disagreements(results: Mapping) -> Iterator[Finding]:
    """The strongest pair that two metrics order differently, both beyond doubt."""
    flips = (results.get("rankings") or {}).get("flips", [])
    cells = {cell["id"]: cell for cell in _scored(results)}
    flips = [flip for flip in flips if flip["a"] in cells and flip["b"] in cells and flip["strength"] > 0]
    if not flips:
        return
    one = flips[0]
    a, b = cells[one["a"]], cells[one["b"]]

    def clause(side: str) -> str:
        metric = next((m for m in one[side] if m != "rel_bias"), one[side][0])
        unit = "%" if metric in ("rel_rmse", "rel_bias") else ""
        return f"{metric}: {measured(a['metrics'][metric], unit)} beside {measured(b['metrics'][metric], unit)}"

    parts = (
        _name(a), (f" is nearer to the truth by {clause('prefer_a')}, but ", ""), _name(b),
        (f" by {clause('prefer_b')} (first figure: the former). ", ""),
        (f"{_count(len(flips), 'pair')} of this kind", "#rankings"), (".", ""),
    )  # fmt: skip
    yield Finding("Metrics disagree", parts, 55.0)


def exact(results: Mapping) -> Iterator[Finding]:
    """Cells without an error beyond the noise, and how large it could be at most."""
    cells = [cell for cell in _scored(results) if _end(cell, 0) <= 0 or _end(cell, 1) <= ROUNDING]
    if cells:
        top = max(cells, key=lambda cell: _end(cell, 1))
        count = f"{len(cells)} of {len(_scored(results))} cells have no error beyond noise and rounding"
        error = f": relative RMSE {measured(top['metrics'][ERROR], '%')}."
        parts = ((f"{count}. The least sure is ", ""), _name(top), (error, ""))
        lines = tuple((_name(cell), (f": {measured(cell['metrics'][ERROR], '%')}.", "")) for cell in cells[:LINES])
        yield Finding("Right within the noise", parts, 45.0, lines)


def inconclusive(results: Mapping) -> Iterator[Finding]:
    """Neighbours whose order noise could change; the headline pair has the largest error at stake."""
    pairs = [pair for group in results.get("comparisons") or [] for pair in group["pairs"]]
    pairs = [pair for pair in pairs if pair["difference"]["value"] != 0 or pair["decided"]]  # the same picture twice has no order
    open_ = [pair for pair in pairs if not pair["decided"]]
    cells = {cell["id"]: cell for cell in _scored(results)}
    open_ = [pair for pair in open_ if pair["better"] in cells and pair["worse"] in cells]
    if not open_:
        return
    open_.sort(key=lambda pair: -cells[pair["worse"]]["metrics"][ERROR]["value"])
    lines = tuple(_pair(cells, pair) for pair in open_[:LINES])
    head = (
        f"{len(open_)} of {len(pairs)} neighbours in order of mean squared error: noise could change which is better. First ",
        "",
    )
    yield Finding("Orders that noise could change", (head, *lines[0]), 50.0, lines, undecided=True)


def _pair(cells: Mapping[str, Mapping], pair: Mapping) -> tuple[Part, ...]:
    worse, better = (_name(cells[pair[side]]) for side in ("worse", "better"))
    return worse, (" less ", ""), better, (f": {measured(pair['difference'])} radiance².", "")


#: In no order; their findings' weights order them.
MAKERS: tuple[Callable[[Mapping], Iterator[Finding]], ...] = (
    without_score, constants, largest, costliest, against_each_truth, crossings, disagreements, inconclusive, exact,
)  # fmt: skip


def _scored(results: Mapping) -> list[Mapping]:
    """Cells with a relative error."""
    return [
        cell for cell in results.get("cells", [])
        if cell.get("status") == "scored" and (cell.get("metrics") or {}).get(ERROR, {}).get("value") is not None
    ]  # fmt: skip


def _end(cell: Mapping, which: int) -> float:
    end = cell["metrics"][ERROR]["ci95"][which]
    return (float("inf") if which else 0.0) if end is None else end


def _side(word: str, cell: Mapping, decided: bool) -> tuple[Part, ...]:
    doubt = "" if decided else ", undecided"
    return (f"{word} ", ""), _name(cell), (f" {measured(cell['metrics'][ERROR], '%')}{doubt}", "")


def _name(cell: Mapping) -> Part:
    """A cell as a link: its technique, what was stated, its scene and target."""
    stated = [f"{k} {plain(v)}" for k, v in (cell.get("parameters") or {}).items() if k != "env"]
    where = ", ".join(filter(None, (cell["scene"], cell.get("environment") or (cell.get("parameters") or {}).get("env"))))
    return f"{', '.join([cell['technique'], *stated])} ({where}, {cell['target']})", cell["id"]


def _where(group: Mapping) -> str:
    shared = ", ".join(f"{name} {plain(value)}" for name, value in group["shared"].items())
    return ", ".join(filter(None, (group["scene"], shared, group["target"])))


def _count(number_: int, thing: str) -> str:
    return f"{number_} {thing}{'' if number_ == 1 else 's'}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def sections(found: Sequence[Finding]) -> set[str]:
    """The sections that findings lead to, to be sure that the page has them."""
    return {link for one in found for line in (one.parts, *one.lines) for _, link in line if link.startswith("#")}
