"""Runs that go on after a kill: `tlpsim run --checkpoint-every` and `tlpsim resume`.

The checkpoint of the results file NAME is NAME.checkpoint, with its spool of samples, NAME.checkpoint.spool. What was
run is kept in it, so that the name of the results file is all that one needs to go on.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import chdir, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tlpsim.orchestrator.checkpoint import Checkpoint, CheckpointError, Checkpoints, read
from tlpsim.orchestrator.clock import to_positive_ticks, to_seconds
from tlpsim.orchestrator.observers import Observer
from tlpsim.scenarios.generic import opened, run_system
from tlpsim.scenarios.results import Results, is_being_written
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario


@dataclass(frozen=True, slots=True, kw_only=True)
class Interrupted:
    """A run that ended before its time and can go on.

    Parameters
    ----------
    destination
        Its results file.
    checkpoint
        Where it goes on.
    time, stop
        Of the checkpoint, and of the end of the run, s.
    """

    destination: Path
    checkpoint: Checkpoint
    time: float
    stop: float


def checkpoint_path(destination: str | Path) -> Path:
    """Path of the checkpoint of a results file."""
    path = Path(destination)
    return path.with_name(path.name + ".checkpoint")


def scenario_request(scenario: Scenario) -> dict[str, Any]:
    """What a checkpoint keeps of a scenario's run."""
    return {"scenario": scenario.to_json(), "stop": scenario.simulation.duration}


def system_request(
    files: Sequence[str],
    connect: Sequence[str],
    steps: Sequence[str],
    settings: Sequence[str],
    start: float,
    stop: float,
) -> dict[str, Any]:
    """What a checkpoint keeps of the run of any other system: arguments of `tlpsim.scenarios.generic`."""
    opening = {"files": list(files), "connect": list(connect), "steps": list(steps), "settings": list(settings)}
    return {"opening": opening, "start": start, "stop": stop}


@contextmanager
def checkpointed(
    destination: str | Path, every: float | None, request: Mapping[str, Any]
) -> Iterator[Checkpoints | None]:
    """Checkpoints of a run that begins; without a checkpoint in the end, nothing is left behind.

    Parameters
    ----------
    destination
        Results file.
    every
        Interval in s of simulated time; None for no checkpoints.
    request
        What is run, from `scenario_request` or `system_request`.

    Raises
    ------
    CheckpointError
        When there is a checkpoint of an earlier run, a run into it goes on, or the spool cannot be written.
    WiringError
        When the interval is not positive.
    """
    if every is None:
        yield None
        return
    path = checkpoint_path(destination)
    interval = to_positive_ticks(every, "--checkpoint-every")
    _require_ended(destination)
    if path.exists():
        raise CheckpointError(
            f"{path}: an earlier run into {destination} can go on from here by `tlpsim resume {destination}`; "
            f"delete {path} to start afresh"
        )
    data = {"request": json.dumps(dict(request)), "folder": str(Path.cwd()), "every": str(interval)}
    with _cleared(Checkpoints(path.absolute(), interval, data)) as checkpoints:
        yield checkpoints


@contextmanager
def _cleared(checkpoints: Checkpoints) -> Iterator[Checkpoints]:
    """Close the spool in any case, and remove it where no checkpoint refers to it."""
    try:
        yield checkpoints
    finally:
        with checkpoints.spool:
            pass
        if not checkpoints.path.exists():
            checkpoints.spool.path.unlink(missing_ok=True)


def interrupted(destination: str | Path) -> Interrupted:
    """The run of a results file that can go on.

    Raises
    ------
    CheckpointError
        When the run is complete or goes on, or there is no checkpoint of it.
    """
    destination = Path(destination)
    if destination.is_dir():
        raise CheckpointError(f"{destination}: is a folder; give the name of a results file")
    path = checkpoint_path(destination)
    _require_ended(destination)
    if destination.is_file():
        if not path.exists():
            raise CheckpointError(f"{destination}: there is no checkpoint beside it, so there is nothing to resume")
        if destination.stat().st_mtime_ns >= path.stat().st_mtime_ns:
            raise CheckpointError(
                f"{destination}: is complete and newer than its checkpoint; there is nothing to resume: delete {path}"
            )
    checkpoint = read(path)
    folder = checkpoint.data.get("folder")
    if folder is None:
        raise CheckpointError(f"{path}: was not written by `tlpsim run`, which alone can be resumed")
    if not Path(folder).is_dir():
        raise CheckpointError(f"{path}: the run began in {folder}, which is no longer there; restore it")
    return Interrupted(
        destination=destination,
        checkpoint=checkpoint,
        time=to_seconds(checkpoint.time),
        stop=json.loads(checkpoint.data["request"])["stop"],
    )


def _require_ended(destination: str | Path) -> None:
    if is_being_written(destination):
        raise CheckpointError(f"{destination}: a run is writing it; wait until it has ended, or stop it first")


def resume(run: Interrupted, observers: Sequence[Observer] = ()) -> Results:
    """Let a run go on from its checkpoint to its end, and open its results.

    It works in the folder in which the run began, so that relative paths mean what they meant.

    Parameters
    ----------
    run
        Found by `interrupted`.
    observers
        Who gets the samples, from the first one on.

    Raises
    ------
    CheckpointError
        When an FMU, a parameter or a connection is not what it was, or the spool is damaged.
    TlpsimError
        As `tlpsim.scenarios.run.run_scenario`.
    """
    destination = run.destination.absolute()
    data = run.checkpoint.data
    request = json.loads(data["request"])
    resumed = Checkpoints(checkpoint_path(destination), int(data["every"]), data, run.checkpoint)
    with _cleared(resumed) as checkpoints, chdir(data["folder"]):
        if "scenario" in request:
            scenario = Scenario.from_json(request["scenario"])
            return run_scenario(scenario, destination, observers, checkpoints=checkpoints)
        with opened(**request["opening"]) as description:
            times = request["stop"], request["start"]
            return run_system(description, destination, *times, observers=observers, checkpoints=checkpoints)


def hint(destination: str | Path) -> str:
    """How to go on with a run that was interrupted, for the end of a message; "" without a checkpoint."""
    return f"; go on with: tlpsim resume {destination}" if checkpoint_path(destination).exists() else ""
