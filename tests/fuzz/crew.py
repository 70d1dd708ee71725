"""Reads damaged files in a process of its own, under limits of memory and time, so that a crash has a name: its seed."""

from __future__ import annotations

import importlib
import multiprocessing
import os
import resource
import signal
import tempfile
import time
import traceback
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import damage

from evalsuite.errors import EvalsuiteError

#: Longest that one file may take [s]; most that the process may grow [bytes]; address space, beyond which nothing is given.
SECONDS, GROWTH, ADDRESS_SPACE = 20.0, 600 << 20, 6 << 30
#: What an allocation that the system refused says.
_MEMORY = ("memoryerror", "bad_alloc", "unable to allocate", "cannot allocate", "out of memory", "std::length_error")


@dataclass
class Tally:
    """Of `count` files. findings: (seed, what happened). growth: of the process's peak memory [bytes]. slowest [s]."""

    name: str
    accepted: int = 0
    refused: int = 0
    findings: list[tuple[int, str]] = field(default_factory=list)
    growth: int = 0
    slowest: float = 0.0
    words: Counter = field(default_factory=Counter)

    def __str__(self) -> str:
        count = self.accepted + self.refused + len(self.findings)
        return (
            f"{self.name}: {count} files, {self.accepted} accepted, {self.refused} refused, {len(self.findings)} findings, "
            f"slowest {self.slowest:.2f} s, memory +{self.growth >> 20} MB"
        )


def fuzz(name: str, seeds: range, seconds: float = SECONDS) -> Tally:
    """Read the damaged files of `readers` under that name. A death or a hang costs one file; the next begins anew."""
    tally, pending = Tally(name), list(seeds)
    while pending:
        _one_process(name, pending, seconds, tally)
    return tally


def _one_process(name: str, pending: list[int], seconds: float, tally: Tally) -> None:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    child = context.Process(target=_work, args=(name, list(pending), theirs), daemon=True)
    child.start()
    theirs.close()
    current, limit = None, 120.0  # starting up imports Mitsuba
    try:
        while pending:
            if not ours.poll(limit):
                tally.findings.append((pending.pop(0), f"hung for {limit:.0f} s"))
                return
            kind, seed, *rest = ours.recv()
            if kind == "begin":
                current, limit = seed, seconds
                continue
            pending.remove(seed)
            outcome, spent, growth = rest
            tally.slowest = max(tally.slowest, spent)
            tally.growth = max(tally.growth, growth)
            if outcome == "accepted":
                tally.accepted += 1
            elif outcome.startswith("refused"):
                tally.refused += 1
                tally.words[outcome] += 1
            else:
                tally.findings.append((seed, outcome))
    except EOFError:
        child.join()
        if child.exitcode == 0:  # grown: the file is told of already
            return
        seed = current if current in pending else pending[0]
        pending.remove(seed)
        tally.findings.append((seed, f"process died with exit code {child.exitcode}"))
    finally:
        child.kill()
        child.join()
        ours.close()


def _work(name: str, seeds: list[int], pipe) -> None:
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        readers = importlib.import_module("readers")
        reader = readers.READERS.get(name, readers.fault)(Path(folder))
        resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        for seed in seeds:
            file = Path(folder) / reader.file
            file.parent.mkdir(exist_ok=True)
            file.write_bytes(damage.mutated(reader.mutator, seed, reader.corpus))
            pipe.send(("begin", seed))
            start = time.perf_counter()
            outcome = _outcome(reader.read, file)
            growth = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) << 10
            if growth > GROWTH and not outcome.startswith("raised"):
                outcome = f"memory grew by {growth >> 20} MB ({outcome})"
            pipe.send(("end", seed, outcome, time.perf_counter() - start, growth))
            if growth > GROWTH:
                os._exit(0)  # the peak never falls: the next file needs a process of its own
        pipe.send(("done", -1))


def _outcome(read, file: Path) -> str:
    try:
        read(file)
    except EvalsuiteError as error:
        line = str(error)
        if not line.isprintable():
            return f"more than one line: {line[:100]!r}"
        if any(word in line.lower() for word in _MEMORY):
            return f"memory was asked for: {line[:200]}"
        return "refused: " + error.expected[:60]
    except BaseException as error:
        where = traceback.extract_tb(error.__traceback__)
        own = [frame for frame in where if "evalsuite" in frame.filename and "tests" not in frame.filename] or where
        return f"raised {type(error).__name__}: {str(error)[:120]} at {Path(own[-1].filename).name}:{own[-1].lineno}"
    return "accepted"


def main() -> None:
    """`python tests/fuzz/crew.py NAME FIRST COUNT`: the figures, and each finding with its seed."""
    import sys

    name, first, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    tally = fuzz(name, range(first, first + count))
    print(tally, flush=True)
    for seed, what in tally.findings:
        print(f"  {seed}: {what}")


if __name__ == "__main__":
    main()
