"""What findings are made of: sentences whose pieces lead somewhere, and how cells are named in them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from evalsuite.report.numbers import plain

#: A piece of a sentence: words, and the cell's id or "#section" that they lead to; "" for words alone.
Part = tuple[str, str]
#: The most lines below a finding.
LINES = 40
#: What is called the error: relative to the mean reference, so that cells of unlike brightness can be compared.
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


def scored(results: Mapping) -> list[Mapping]:
    """Cells with a relative error."""
    return [
        cell for cell in results.get("cells", [])
        if cell.get("status") == "scored" and (cell.get("metrics") or {}).get(ERROR, {}).get("value") is not None
    ]  # fmt: skip


def end_of(cell: Mapping, which: int) -> float:
    end = cell["metrics"][ERROR]["ci95"][which]
    return (float("inf") if which else 0.0) if end is None else end


def name_of(cell: Mapping) -> Part:
    """A cell as a link: its technique, what was stated, its scene and target."""
    stated = [f"{k} {plain(v)}" for k, v in (cell.get("parameters") or {}).items() if k != "env"]
    where = ", ".join(filter(None, (cell["scene"], cell.get("environment") or (cell.get("parameters") or {}).get("env"))))
    return f"{', '.join([cell['technique'], *stated])} ({where}, {cell['target']})", cell["id"]


def count_of(number_: int, thing: str) -> str:
    return f"{number_} {thing}{'' if number_ == 1 else 's'}"


def capital(text: str) -> str:
    return text[:1].upper() + text[1:]
