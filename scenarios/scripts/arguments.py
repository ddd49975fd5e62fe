"""What the ready scripts share: two options, and the folder of their scenario files."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

SCENARIOS = Path(__file__).parents[1]
"""Folder of the scenario files."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Arguments:
    """Folder for the results, which exists, and settings of the scenario that go over its file."""

    folder: Path
    settings: list[str]


def arguments(description: str | None, argv: list[str] | None = None) -> Arguments:
    """Read the command line of a script; leaves the program where it is wrong.

    Parameters
    ----------
    description
        The script's, of which the first line is shown.
    argv
        Without the program's name; that of the program if not given.
    """
    parser = argparse.ArgumentParser(description=(description or "").partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("results"), metavar="DIR", help="folder for results")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="set a key of the scenario")
    parser.add_argument("--duration", metavar="S", help="duration in s, or with a unit: 3h")
    given = parser.parse_args(argv)
    given.output.mkdir(parents=True, exist_ok=True)
    duration = [] if given.duration is None else [f"simulation.duration={given.duration}"]
    return Arguments(folder=given.output, settings=[*given.set, *duration])
