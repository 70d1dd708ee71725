"""How fast evalsuite is, each figure beside the limit that it must keep: `script/bench`. A module a benchmark, each with a TITLE
and `measure(quick)`; docs/benchmarks.md says what they measure."""

#: In the order in which they run: the quick ones first.
NAMES = (
    "start",
    "decomposition",
    "comparison",
    "page",
    "prefilter",
    "frames",
    "workers",
    "scheduler",
    "adaptive",
    "warm",
    "overhead",
)
