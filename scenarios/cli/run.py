"""The commands `tlpsim run` and `tlpsim resume`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tlpsim.loads.errors import ScenarioError
from tlpsim.scenarios.cli.options import Duration, Seed, Settings, interruptible, load

if TYPE_CHECKING:
    from tlpsim.orchestrator.coupling_report import CouplingMeter
    from tlpsim.scenarios.results import Results

Coupling = Annotated[bool, typer.Option("--coupling", help="Measure the errors of interpolation and extrapolation.")]


def run(
    files: Annotated[
        list[str],
        typer.Argument(metavar="SYSTEM...", help="Scenario (.toml), system description (.ssp, .ssd), or FMUs."),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="Results file (HDF5).")],
    duration: Duration = None,
    seed: Seed = None,
    settings: Settings = None,
    monolithic: Annotated[
        bool, typer.Option("--monolithic", help="One loop over the built-in models, without FMUs.")
    ] = False,
    connect: Annotated[
        list[str] | None, typer.Option("--connect", metavar="A.Y=B.U", help="Connect an output to an input (FMUs).")
    ] = None,
    step: Annotated[
        list[str] | None, typer.Option("--step", metavar="[A=]S", help="Step in s, of all FMUs or of one.")
    ] = None,
    stop: Annotated[str | None, typer.Option("--stop", metavar="S", help="Stop time in s (not for scenarios).")] = None,
    start: Annotated[
        str | None, typer.Option("--start", metavar="S", help="Start time in s (not for scenarios).")
    ] = None,
    coupling: Coupling = False,
    checkpoint_every: Annotated[
        str | None,
        typer.Option(metavar="S", help="Keep the state at intervals of simulated time, for `tlpsim resume`."),
    ] = None,
) -> None:
    """Run a scenario and print the response by degree of freedom, or run any system and print its outputs."""
    if Path(files[0]).suffix != ".toml":
        if monolithic or seed is not None or duration is not None:
            raise ScenarioError("--monolithic, --seed and --duration are for scenarios: use --stop, --step and --set")
        texts = (connect or [], step or [], settings or [])
        _run_generic(files, output, texts, stop, start, coupling, checkpoint_every)
        return
    if len(files) > 1 or connect or step or stop or start:
        raise ScenarioError(
            "--connect, --step, --start and --stop are not for scenarios, which stand alone: use --duration and --set"
        )
    if coupling and monolithic:
        raise ScenarioError("--coupling measures connections, and a monolithic run has none: leave one of the two out")
    from tlpsim.scenarios.console import progress_bar
    from tlpsim.scenarios.resume import checkpointed, scenario_request
    from tlpsim.scenarios.run import run_scenario

    chosen = load(Path(files[0]), duration, seed, settings)
    every = _interval(checkpoint_every)
    meters = _meters(coupling)
    with (
        _leaving(output),
        checkpointed(output, every, scenario_request(chosen)) as checkpoints,
        progress_bar(chosen.simulation.duration) as progress,
    ):
        observers = [progress, *meters]
        results = run_scenario(chosen, output, observers, monolithic=monolithic, checkpoints=checkpoints)
    _print_run(results, output, meters, " (monolithic)" if monolithic else "")


def _run_generic(
    files: list[str],
    output: Path,
    texts: tuple[list[str], list[str], list[str]],
    stop: str | None,
    start: str | None,
    coupling: bool,
    checkpoint_every: str | None,
) -> None:
    """Run a system without a platform; `texts` are those of --connect, --step and --set."""
    from tlpsim.orchestrator.system import check as check_system
    from tlpsim.scenarios.console import progress_bar
    from tlpsim.scenarios.generic import experiment, opened, run_system, seconds
    from tlpsim.scenarios.resume import checkpointed, system_request

    every = _interval(checkpoint_every)
    meters = _meters(coupling)
    given = (None if stop is None else seconds(stop, "--stop"), None if start is None else seconds(start, "--start"))
    with opened(files, *texts) as description:
        for note in (*description.notes, *check_system(description.system)):
            typer.echo(f"note: {note}")
        begin, end = experiment(description, *given)
        with (
            _leaving(output),
            checkpointed(output, every, system_request(files, *texts, begin, end)) as checkpoints,
            progress_bar(end, begin) as progress,
        ):
            results = run_system(description, output, end, begin, [progress, *meters], checkpoints)
    _print_run(results, output, meters)


def resume(
    output: Annotated[Path, typer.Argument(metavar="FILE", help="Results file (HDF5) of `tlpsim run`.")],
    coupling: Coupling = False,
) -> None:
    """Let a run that was interrupted or killed go on from its last checkpoint, see `run --checkpoint-every`."""
    from tlpsim.scenarios.console import progress_bar
    from tlpsim.scenarios.resume import interrupted
    from tlpsim.scenarios.resume import resume as go_on

    found = interrupted(output)
    typer.echo(f"goes on at t = {found.time:g} of {found.stop:g} s")
    meters = _meters(coupling)
    with _leaving(output), progress_bar(found.stop, found.time) as progress:
        results = go_on(found, [progress, *meters])
    _print_run(results, output, meters)


def _interval(text: str | None) -> float | None:
    from tlpsim.scenarios.generic import seconds

    return None if text is None else seconds(text, "--checkpoint-every")


@contextmanager
def _leaving(output: Path) -> Iterator[None]:
    """On Ctrl-C, tell what an interrupted run leaves, and how to go on with it."""
    from tlpsim.scenarios.resume import hint

    with interruptible(lambda: f"interrupted; the samples so far are in {output}.part{hint(output)}"):
        yield


def _print_run(results: Results, output: Path, meters: list[CouplingMeter], how: str = "") -> None:
    from tlpsim.scenarios.console import print_summary

    print_summary(results)
    if meters:
        from tlpsim.scenarios.coupling import print_measures

        print_measures(meters[0].measures())
    typer.echo(f"results: {output}{how}")


def _meters(wanted: bool) -> list[CouplingMeter]:
    """The observer of `--coupling`, where it is wanted."""
    if not wanted:
        return []
    from tlpsim.orchestrator.coupling_report import CouplingMeter

    return [CouplingMeter()]
