"""What every benchmark script shares: rows of item, measured, bound, ok; one table; exit code 1 on a miss.

`--json docs/data/NAME.json` keeps the rows for the page docs/validation.md.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

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
    parser.add_argument("--json", type=Path, metavar="FILE", help="keep the rows as JSON too, as docs/data/NAME.json")
    asked = parser.parse_args()
    console = Console(width=120, highlight=False)
    table = Table(title=f"{title}{' (quick)' if asked.quick else ''}")
    for heading in ("item", "measured", "bound", "ok"):
        table.add_column(heading)
    kept: list[dict[str, Any]] = []
    for part in parts:
        began = time.perf_counter()
        rows = [tidy(row) for row in part(asked.quick)]
        seconds = time.perf_counter() - began
        print(f"{part.__module__}.{part.__name__}: {seconds:.1f} s", file=sys.stderr, flush=True)
        kept.append({"part": part.__name__, "seconds": round(seconds, 1), "rows": [asdict(row) for row in rows]})
        for row in rows:
            table.add_row(row.item, row.measured, row.bound, WORDS[row.ok])
        table.add_section()
    console.print(table)
    if asked.json is not None:
        asked.json.parent.mkdir(parents=True, exist_ok=True)
        content = {"title": title, "quick": asked.quick, "processors": os.cpu_count(), "parts": kept}
        asked.json.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    sys.exit(1 if any(row["ok"] is False for part in kept for row in part["rows"]) else 0)


def tidy(row: Row) -> Row:
    """Row of plain values, without the spaces that an empty unit leaves."""
    ok = None if row.ok is None else bool(row.ok)
    return replace(row, measured=row.measured.strip(), bound=row.bound.strip(), ok=ok)
