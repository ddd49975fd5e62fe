"""What commands of `tlpsim` share: options, the scenario that they choose, Ctrl-C."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from tlpsim.scenarios.schema import Scenario

ScenarioFile = Annotated[Path, typer.Argument(metavar="SCENARIO", help="Scenario file (TOML).")]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Set a key of the scenario, as in waves.significant_height=9."),
]
Duration = Annotated[str | None, typer.Option(metavar="S", help="Duration in s, or with a unit: 3h.")]
Seed = Annotated[int | None, typer.Option(metavar="N", help="Seed of wind and waves.")]


@contextmanager
def interruptible(told: Callable[[], str]) -> Iterator[None]:
    """On Ctrl-C, tell so and leave with the exit code of an interrupt."""
    try:
        yield
    except KeyboardInterrupt:
        typer.echo(f"tlpsim: {told()}", err=True)
        raise typer.Exit(130) from None


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


def show_warning(message: Warning | str, *origin: object, **_: object) -> None:
    """Show a warning as one line; to take the place of `warnings.showwarning`."""
    typer.echo(f"tlpsim: warning: {message}", err=True)
