"""The store: cache info, share, verify, prune."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.progress import Progress

from evalsuite.cli.app import Json, app, err, out, print_json, print_table

cache_app = typer.Typer(no_args_is_help=True, help="The store of rendered pictures.")
app.add_typer(cache_app, name="cache")


@cache_app.command("info")
def cache_info(as_json: Json = False) -> None:
    """Where the store is and how much it holds."""
    from evalsuite.commands import cache_facts

    facts = cache_facts()
    if as_json:
        print_json(facts)
        return
    print(facts["path"])
    print_table(facts["kinds"], ["kind", "entries", "megabytes"])
    if shared := facts["shared"]:
        text = shared["problem"] or "{entries} entries, {megabytes} MB".format(**shared)
        out.print(f"shared store {shared['url']}: {text}", markup=False, highlight=False, soft_wrap=True)


@cache_app.command("share")
def cache_share(as_json: Json = False) -> None:
    """Send to the shared store ($EVALSUITE_SHARED) what is here and not there; exit code 1 when not all could be sent."""
    from evalsuite.errors import EvalsuiteError
    from evalsuite.store.cache import Store
    from evalsuite.store.shared import VARIABLE

    problems: list[str] = []
    store = Store(warn=problems.append)
    if store.shared is None:
        raise EvalsuiteError(VARIABLE, "nothing", "the URL or folder of a shared store", f"set {VARIABLE}")
    with Progress(console=err, transient=True) as bar:
        entries = bar.track(list(store.entries()), description="sending")
        sent = sum(store.share(kind, folder.name) for kind, folder in entries)
    if as_json:
        print_json({"url": store.shared.place.shown, "sent": sent, "problems": problems})
    else:
        for problem in problems:
            err.print(f"warning: {problem}", style="yellow", markup=False, highlight=False, soft_wrap=True)
        out.print(f"{sent} entries sent to {store.shared.place.shown}", markup=False, highlight=False, soft_wrap=True)
    if problems:
        raise typer.Exit(1)


@cache_app.command("verify")
def cache_verify(
    remove: Annotated[bool, typer.Option("--remove", help="Take damaged entries out; the next run makes them anew.")] = False,
    as_json: Json = False,
) -> None:
    """Read every entry and hold it against its SHA-256; exit code 1 when something is damaged."""
    from evalsuite.store import upkeep
    from evalsuite.store.cache import Store

    store = Store(shared="")
    with Progress(console=err, transient=True) as bar:
        paths = bar.track(list(upkeep.things(store)), description="reading")
        found = list(upkeep.verify(paths))
    damaged = {path: faults for path, faults in found if faults}
    unsigned = sum(faults is None for _, faults in found)
    if remove:
        upkeep.remove(store, damaged)
    rows = [
        {"file": str(fault.file), "found": fault.found, "expected": fault.expected}
        for faults in damaged.values()
        for fault in faults
    ]
    if as_json:
        print_json({"path": str(store.root), "entries": len(found), "unsigned": unsigned, "damaged": rows, "removed": remove})
    else:
        for row in rows:
            out.print("{file}: found {found}, expected {expected}".format(**row), markup=False, highlight=False, soft_wrap=True)
        old = f", {unsigned} of earlier versions, which no run reads" if unsigned else ""
        mended = " and removed" if damaged and remove else ""
        out.print(f"{len(found)} entries, {len(damaged)} damaged{mended}{old}", highlight=False)
        if damaged and not remove:
            out.print("`evalsuite cache verify --remove` takes them out", highlight=False)
    if damaged:
        raise typer.Exit(1)


@cache_app.command("prune")
def cache_prune(
    max_size: Annotated[str, typer.Option(metavar="SIZE", help="What may stay, as 10GB, 500MB or 2GiB.")],
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would go.")] = False,
    as_json: Json = False,
) -> None:
    """Remove what was used least recently, but nothing that a running process uses, until the store is small enough."""
    from evalsuite.store import upkeep
    from evalsuite.store.cache import Store

    found = upkeep.prune(Store(shared=""), upkeep.bytes_of(max_size), dry_run=dry_run)
    if as_json:
        print_json(found)
        return
    done = "would be removed" if dry_run else "removed"
    use = f", {found['kept_in_use']} kept for running processes" if found["kept_in_use"] else ""
    sizes = "{:.1f} MB → {:.1f} MB".format(found["before"] / 1e6, found["after"] / 1e6)
    out.print(f"{sizes}: {found['removed']} {done}{use}", highlight=False)
