"""What every benchmark script shares: rows of item, measured, bound, ok; one table; exit code 1 on a miss."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from rich.console import Console
from rich.table import Table

WORDS = {None: "", True: "yes", False: "NO"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One measured item; `ok` is None where there is nothing to reach."""

    item: str
    measured: str
    bound: str = ""
    ok: bool | None = None


def at_most(item: str, value: float, bound: float, unit: str = "", form: str = ".3g") -> Row:
    return Row(item=item, measured=f"{value:{form}} {unit}", bound=f"≤ {bound:g} {unit}", ok=bool(value <= bound))


def at_least(item: str, value: float, bound: float, unit: str = "", form: str = ".3g") -> Row:
    return Row(item=item, measured=f"{value:{form}} {unit}", bound=f"≥ {bound:g} {unit}", ok=bool(value >= bound))


def within(item: str, value: float, target: float, relative: float, unit: str = "", form: str = ".5g") -> Row:
    ok = bool(abs(value - target) <= relative * abs(target))
    return Row(item=item, measured=f"{value:{form}} {unit}", bound=f"{target:g} {unit} ± {100 * relative:g} %", ok=ok)


def main(title: str, parts: Sequence[Callable[[bool], Sequence[Row]]]) -> None:
    """Run the parts of a benchmark, print one table, and leave with 1 where a bound is missed."""
    parser = argparse.ArgumentParser(description=title)
    parser.add_argument("--quick", action="store_true", help="shorter records, under a minute in all")
    quick = parser.parse_args().quick
    console = Console(width=120, highlight=False)
    table = Table(title=f"{title}{' (quick)' if quick else ''}")
    for heading in ("item", "measured", "bound", "ok"):
        table.add_column(heading)
    missed = 0
    for part in parts:
        began = time.perf_counter()
        rows = part(quick)
        print(f"{part.__module__}.{part.__name__}: {time.perf_counter() - began:.1f} s", file=sys.stderr, flush=True)
        for row in rows:
            missed += row.ok is False
            table.add_row(
                row.item, row.measured.strip(), row.bound.strip(), {None: "", True: "yes", False: "NO"}[row.ok]
            )
        table.add_section()
    console.print(table)
    sys.exit(1 if missed else 0)
