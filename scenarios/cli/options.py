"""What commands of `tlpsim` share: options, the scenario that they choose, how warnings are shown."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tlpsim.scenarios.cli import completion
from tlpsim.scenarios.terminal import complain

if TYPE_CHECKING:
    from tlpsim.scenarios.schema import Scenario

ScenarioFile = Annotated[Path, typer.Argument(metavar="SCENARIO", help="Scenario file (TOML).")]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Set a key of the scenario, as in waves.significant_height=9; may be given again.",
        autocompletion=completion.settings,
    ),
]
Duration = Annotated[str | None, typer.Option(metavar="S", help="Duration in s, or with a unit: 3h.")]
Seed = Annotated[int | None, typer.Option(metavar="N", help="Seed of wind and waves.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON on standard output, and nothing else there.")]


def load(path: Path, duration: str | None, seed: int | None, settings: list[str] | None) -> Scenario:
    """Scenario of a file, with the settings of the command line over it.

    Raises
    ------
    ScenarioError
        As `Scenario.load`.
    """
    from tlpsim.scenarios.schema import Scenario

    overrides = list(settings or [])
    if duration is not None:
        overrides.append(f"simulation.duration={duration}")
    if seed is not None:
        overrides.append(f"simulation.seed={seed}")
    return Scenario.load(path, overrides)


def print_json(content: object) -> None:
    """Print nested content as JSON, also where the command is quiet: who asks for JSON wants it."""
    from tlpsim.scenarios.json_text import json_text

    typer.echo(json_text(content))


def show_warning(message: Warning | str, *origin: object, **_: object) -> None:
    """Show a warning as one line; to take the place of `warnings.showwarning`."""
    complain(f"tlpsim: warning: {message}")
