"""Run a scenario: load and wire its FMUs, or take their models without FMI; step to the end; leave a results file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tlpsim.loads.errors import ScenarioError, TlpsimError
from tlpsim.orchestrator.checkpoint import Checkpoints
from tlpsim.orchestrator.clock import to_ticks
from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.observers import Observer
from tlpsim.scenarios.assemble import assembled
from tlpsim.scenarios.results import Results, open_results
from tlpsim.scenarios.results_writer import ResultsWriter
from tlpsim.scenarios.schema import Scenario


def run_scenario(
    scenario: Scenario,
    destination: str | Path,
    observers: Sequence[Observer] = (),
    *,
    monolithic: bool = False,
    checkpoints: Checkpoints | None = None,
) -> Results:
    """Run a scenario and open its results.

    Parameters
    ----------
    scenario
        What to run.
    destination
        Results file (HDF5). It appears when the run is complete; until then, and after a failure, the samples
        so far are in the same name with `.part`.
    observers
        Who else gets the samples as they come.
    monolithic
        Run the models of the built-in components in one loop instead of their FMUs, see
        `tlpsim.scenarios.monolithic`.
    checkpoints
        Where the state of the run is kept, see `tlpsim.scenarios.resume.checkpointed`.

    Raises
    ------
    TlpsimError
        When the scenario, an FMU, the wiring, a step or the destination is at fault; the message says which.
    """
    if monolithic:
        if checkpoints is not None:
            raise ScenarioError("checkpoints keep the state of FMUs, and a monolithic run has none: leave one out")
        from tlpsim.scenarios.monolithic import MonolithicWriter, run_monolithic

        writer: ResultsWriter = MonolithicWriter(destination, scenario)
        try:
            run_monolithic(scenario, [writer, *observers])
        except TlpsimError as error:
            raise _with_part(error, writer) from error
        return open_results(destination)
    writer = ResultsWriter(destination, scenario)
    with assembled(scenario) as assembly:
        stop = to_ticks(scenario.simulation.duration, "simulation.duration")
        try:
            run(assembly.system, stop, observers=[writer, *observers], checkpoints=checkpoints)
        except TlpsimError as error:
            raise _with_part(error, writer) from error
    return open_results(destination)


def _with_part(error: TlpsimError, writer: ResultsWriter) -> TlpsimError:
    """The error with the place of the samples so far, where there are any."""
    return type(error)(f"{error}; the samples so far are in {writer.part_path}") if writer.has_started else error
