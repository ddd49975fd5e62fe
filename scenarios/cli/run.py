"""The commands `tlpsim run` and `tlpsim resume`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.whole_file import require_writable
from tlpsim.scenarios.cli.endings import interruptible
from tlpsim.scenarios.cli.options import Duration, Json, Seed, Settings, load, print_json
from tlpsim.scenarios.terminal import say

if TYPE_CHECKING:
    from tlpsim.scenarios.results import Results

Coupling = Annotated[bool, typer.Option("--coupling", help="Show the errors of interpolation and extrapolation.")]


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
    json: Json = False,
) -> None:
    """Run a scenario, or any system of FMUs, and print the response."""
    if Path(files[0]).suffix != ".toml":
        if monolithic or seed is not None or duration is not None:
            raise ScenarioError("--monolithic, --seed and --duration are for scenarios: use --stop, --step and --set")
        texts = (connect or [], step or [], settings or [])
        _run_generic(files, output, texts, stop, start, coupling, checkpoint_every, json)
        return
    if len(files) > 1 or connect or step or stop or start:
        raise ScenarioError(
            "--connect, --step, --start and --stop are not for scenarios, which stand alone: use --duration and --set"
        )
    if coupling and monolithic:
        raise ScenarioError("--coupling measures connections, and a monolithic run has none: leave one of the two out")
    require_writable(output)
    from tlpsim.scenarios.progress import run_progress
    from tlpsim.scenarios.resume import checkpointed, scenario_request
    from tlpsim.scenarios.run import run_scenario

    chosen = load(Path(files[0]), duration, seed, settings)
    every = _interval(checkpoint_every)
    with (
        _leaving(output),
        checkpointed(output, every, scenario_request(chosen)) as checkpoints,
        run_progress(chosen.simulation.duration) as progress,
    ):
        results = run_scenario(chosen, output, [progress], monolithic=monolithic, checkpoints=checkpoints)
    _show(results, output, coupling, (), json, " (monolithic)" if monolithic else "")


def _run_generic(
    files: list[str],
    output: Path,
    texts: tuple[list[str], list[str], list[str]],
    stop: str | None,
    start: str | None,
    coupling: bool,
    checkpoint_every: str | None,
    json: bool,
) -> None:
    """Run a system without a platform; `texts` are those of --connect, --step and --set."""
    from tlpsim.orchestrator.system import check as check_system
    from tlpsim.scenarios.generic import experiment, opened, run_system, seconds
    from tlpsim.scenarios.progress import run_progress
    from tlpsim.scenarios.resume import checkpointed, system_request

    every = _interval(checkpoint_every)
    given = (None if stop is None else seconds(stop, "--stop"), None if start is None else seconds(start, "--start"))
    require_writable(output)
    with opened(files, *texts) as description:
        notes = (*description.notes, *check_system(description.system))
        for note in notes:
            say(f"note: {note}", aside=json)
        begin, end = experiment(description, *given)
        with (
            _leaving(output),
            checkpointed(output, every, system_request(files, *texts, begin, end)) as checkpoints,
            run_progress(end, begin) as progress,
        ):
            results = run_system(description, output, end, begin, [progress], checkpoints)
    _show(results, output, coupling, notes, json)


def resume(
    output: Annotated[Path, typer.Argument(metavar="FILE", help="Results file (HDF5) of `tlpsim run`.")],
    coupling: Coupling = False,
    json: Json = False,
) -> None:
    """Go on with a run that was interrupted or killed, from its last checkpoint, see `run --checkpoint-every`."""
    from tlpsim.scenarios.progress import run_progress
    from tlpsim.scenarios.resume import interrupted
    from tlpsim.scenarios.resume import resume as go_on

    found = interrupted(output)
    say(f"goes on at t = {found.time:g} of {found.stop:g} s", aside=json)
    with _leaving(output), run_progress(found.stop, found.time) as progress:
        results = go_on(found, [progress])
    _show(results, output, coupling, (), json)


def _interval(text: str | None) -> float | None:
    from tlpsim.scenarios.generic import seconds

    return None if text is None else seconds(text, "--checkpoint-every")


@contextmanager
def _leaving(output: Path) -> Iterator[None]:
    """On Ctrl-C or SIGTERM, tell what an interrupted run leaves, how to look at it, and how to go on with it."""
    from tlpsim.scenarios.resume import hint

    part = output.with_name(output.name + ".part")
    before = _identity(part)

    def remains() -> str:
        if _identity(part) == before:
            return f"the run had not begun{hint(output)}"
        return f"the samples so far are in {part}; open it with: tlpsim info {part}{hint(output)}"

    with interruptible(remains):
        yield


def _identity(path: Path) -> tuple[int, int] | None:
    """Which file this is, and when it was written; None without one."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns


def _show(results: Results, output: Path, coupling: bool, notes: Sequence[str], json: bool, how: str = "") -> None:
    if json:
        from tlpsim.scenarios.json_content import results_content

        print_json(results_content(results, notes))
    else:
        from tlpsim.scenarios.console import print_summary

        print_summary(results)
        if coupling:
            from tlpsim.scenarios.coupling import print_measures

            print_measures(results.coupling)
    say(f"results: {output}{how}", aside=json)
