"""Finds an LLVM that Dr.Jit can use here, and brings up Mitsuba's `llvm_ad_rgb` with our plugins.

Dr.Jit aborts the whole process on some LLVM/processor pairs (15 and 16 with AVX-512), so each candidate first renders a
few pixels in a child process. Verdicts are kept in a small file, so that later starts probe nothing.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from evalsuite.errors import MachineLacks

VARIANT = "llvm_ad_rgb"
PROBE_SECONDS = 120.0  # a first start on a slow disk, kernels and all, takes well under 20 s
FIX = "run `apt-get install libllvm19` or `pip install karellen-llvm-core`"

_CHOSEN_BY_USER = os.environ.get("DRJIT_LIBLLVM_PATH")  # before `activate` sets it
_SYSTEM_FOLDERS = ("/usr/lib/llvm-*/lib", "/usr/lib/*-linux-gnu", "/usr/lib64", "/usr/lib", "/usr/local/lib",
                   "/opt/homebrew/opt/llvm*/lib", "/usr/local/opt/llvm*/lib")  # fmt: skip
_LIBRARY = re.compile(r"libLLVM(-\d+[\d.]*)?\.(so|dylib)(\.[\d.]+)?$")


@dataclass(frozen=True)
class Candidate:
    """One LLVM library. origin: where it was found. usable: whether a child process rendered with it. verdict: in words.
    version: LLVM's own, or empty."""

    path: str
    origin: str
    usable: bool
    verdict: str
    version: str = ""


def library_paths() -> Iterator[tuple[Path, str]]:
    """(path, origin) of LLVM libraries in order of preference, each real file once."""
    seen: set[str] = set()
    for path, origin in _all_library_paths():
        if path.is_file() and (real := os.path.realpath(path)) not in seen:
            seen.add(real)
            yield path, origin


def _all_library_paths() -> Iterator[tuple[Path, str]]:
    if _CHOSEN_BY_USER:
        yield Path(_CHOSEN_BY_USER), "DRJIT_LIBLLVM_PATH"
    for name in ("libLLVM.so", "libLLVM.dylib"):
        yield Path(sys.prefix, "lib", name), "Python environment"
    with suppress(importlib.metadata.PackageNotFoundError):
        files = importlib.metadata.files("karellen-llvm-core") or []
        for file in sorted(f for f in files if _LIBRARY.fullmatch(f.name)):
            yield Path(str(file.locate())).resolve(), "karellen-llvm-core"
    with suppress(importlib.metadata.PackageNotFoundError):
        # `pip install --target` moves <prefix>/lib, two levels above site-packages in the record, into the target itself.
        root = Path(str(importlib.metadata.distribution("karellen-llvm-core").locate_file("")))
        yield root / "lib" / "libLLVM.so", "karellen-llvm-core"
    found = [p for folder in _SYSTEM_FOLDERS for p in Path("/").glob(f"{folder[1:]}/libLLVM*") if _LIBRARY.fullmatch(p.name)]
    for path in sorted(found, key=_version_in_name, reverse=True):
        yield path, "system"


def _version_in_name(path: Path) -> tuple[int, ...]:
    real = os.path.realpath(path)
    numbers = re.search(r"libLLVM-?(?:\.so\.|\.dylib\.)?(\d[\d.]*)", os.path.basename(real)) or re.search(r"llvm-(\d+)", real)
    return tuple(int(n) for n in numbers[1].split(".") if n) if numbers else (0,)


def candidates(*, fresh: bool = False) -> Iterator[Candidate]:
    """Verdict on each library, probed in a child process when first asked. fresh: probe again whatever the file says."""
    verdicts = {} if fresh else _read_verdicts()
    for path, origin in library_paths():
        key = _key(path)
        known = verdicts.get(key)
        if known is None:
            known = asdict(_probe(path))
            if not known["verdict"].startswith("no answer"):  # a busy machine says nothing about the library
                verdicts[key] = known
                _write_verdicts(verdicts)
        yield Candidate(**{**known, "path": str(path), "origin": origin})


def working_library() -> Candidate:
    """The first usable library. Raises MachineLacks when there is none."""
    tried = []
    for candidate in candidates():
        if candidate.usable:
            return candidate
        tried.append(f"{candidate.path} ({candidate.verdict})")
    raise MachineLacks("LLVM", "; ".join(tried) or "no libLLVM", "an LLVM library that Dr.Jit can use on this processor", FIX)


_active: Any = None


def activate(threads: int | None = None) -> Any:
    """Mitsuba module with variant `llvm_ad_rgb` set, our plugins registered, and everything quiet; idempotent.

    threads: size of Dr.Jit's thread pool; default $EVALSUITE_THREADS, else all cores. It does not change the pixels.
    Raises MachineLacks when Mitsuba is missing or no LLVM works.
    """
    global _active
    if _active is None or _active.variant() != VARIANT:
        already_up = "mitsuba" in sys.modules and sys.modules["mitsuba"].variant() == VARIANT
        if not already_up:
            os.environ["DRJIT_LIBLLVM_PATH"] = working_library().path
        _active = _bring_up()
    threads = threads or int(os.environ.get("EVALSUITE_THREADS") or 0) or None
    if threads is not None:
        import drjit as dr

        if dr.thread_count() != threads:
            dr.set_thread_count(threads)
    return _active


def _bring_up() -> Any:
    try:
        import drjit as dr
        import mitsuba as mi
    except ImportError as error:
        raise MachineLacks("Mitsuba", f"'{error}' on import", "mitsuba 3.9", "run `pip install mitsuba==3.9.1`") from error
    dr.set_log_level(dr.LogLevel.Error)
    mi.set_variant(VARIANT)
    mi.logger().clear_appenders()  # whatever matters is raised, not printed
    mi.set_log_level(mi.LogLevel.Error)
    from . import bsdfs, integrators

    bsdfs.register()
    integrators.register()
    return mi


def facts() -> dict[str, Any]:
    """{mitsuba, variant, drjit, llvm, cpu} of the activated reference side. Raises MachineLacks."""
    activate()
    import drjit as dr

    llvm = ".".join(str(n) for n in dr.detail.llvm_version())
    return {"mitsuba": _version("mitsuba"), "variant": VARIANT, "drjit": _version("drjit"), "llvm": llvm, "cpu": cpu_model()}


def probe() -> dict[str, Any]:
    """What `evalsuite doctor` reports of the reference side. Probes every library afresh; never raises.

    Keys: mitsuba, drjit (versions or None), cpu, variants (usable ones), llvm (path and version, or None), candidates
    (list of `Candidate` as dictionaries), fix (what to do when `llvm_ad_rgb` is not usable, else empty).
    """
    tried = list(candidates(fresh=True)) if _version("mitsuba") else []
    good = next((c for c in tried if c.usable), None)
    return {
        "mitsuba": _version("mitsuba"),
        "drjit": _version("drjit"),
        "cpu": cpu_model(),
        "variants": [VARIANT] if good else [],
        "llvm": {"path": good.path, "version": good.version} if good else None,
        "candidates": [asdict(c) for c in tried],
        "fix": "" if good else ("run `pip install mitsuba==3.9.1`" if not _version("mitsuba") else FIX),
    }


def _probe(path: Path) -> Candidate:
    package_root = str(Path(__file__).resolve().parents[2])
    environment = os.environ | {
        "DRJIT_LIBLLVM_PATH": str(path),
        "PYTHONPATH": os.pathsep.join(p for p in (package_root, os.environ.get("PYTHONPATH")) if p),
    }
    command = [sys.executable, "-c", "from evalsuite.reference.variants import _probe_here; _probe_here()"]
    try:
        child = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=PROBE_SECONDS)
    except (subprocess.TimeoutExpired, OSError) as error:
        return Candidate(str(path), "", False, f"no answer: {type(error).__name__}")
    if child.returncode == 0:
        with suppress(ValueError, KeyError):
            return Candidate(str(path), "", True, "renders", json.loads(child.stdout.splitlines()[-1])["llvm"])
    last = next((line.strip() for line in reversed(child.stderr.splitlines()) if line.strip()), "")
    ended = f"signal {-child.returncode}" if child.returncode < 0 else f"exit code {child.returncode}"
    return Candidate(str(path), "", False, f"{ended}: {last[:160]}" if last else ended)


def _probe_here() -> None:
    """Body of the child process: a white Phong sphere in a uniform environment."""
    mi = _bring_up()
    import drjit as dr

    scene = mi.load_dict({
        "type": "scene",
        "integrator": {"type": "direct"},
        "sensor": {"type": "perspective", "to_world": mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
                   "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}}},
        "light": {"type": "constant"},
        "ball": {"type": "sphere", "bsdf": {"type": "phong", "exponent": 5.0}},
    })  # fmt: skip
    mean = float(dr.mean(mi.render(scene, spp=16).array)[0])
    if not 0.5 < mean < 1.1:  # background 1, ball at most 1
        raise SystemExit(f"rendered a mean radiance of {mean}")
    print(json.dumps({"llvm": ".".join(str(n) for n in dr.detail.llvm_version())}))


def cpu_model() -> str:
    """Processor name: part of what decides whether an LLVM works and which bits it produces."""
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def _key(path: Path) -> str:
    stat = os.stat(path)
    facts = [os.path.realpath(path), stat.st_mtime_ns, stat.st_size, _version("drjit"), _version("mitsuba"), cpu_model()]
    return hashlib.sha256(json.dumps(facts).encode()).hexdigest()


def _verdict_file() -> Path:
    import platformdirs

    return Path(os.environ.get("EVALSUITE_CACHE") or platformdirs.user_cache_dir("evalsuite")) / "llvm.json"


def _read_verdicts() -> dict[str, Any]:
    with suppress(OSError, ValueError):
        verdicts = json.loads(_verdict_file().read_text())
        if isinstance(verdicts, dict):
            return verdicts
    return {}


def _write_verdicts(verdicts: dict[str, Any]) -> None:
    """Atomic; a folder that cannot be written costs a probe at the next start, nothing else."""
    file = _verdict_file()
    with suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile("w", dir=file.parent, suffix=".tmp", delete=False) as temporary:
            json.dump(verdicts, temporary)
        os.replace(temporary.name, file)
