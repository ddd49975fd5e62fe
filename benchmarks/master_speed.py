"""Wall time a macro step of chains of three FMUs, of this master and of another one; see `master`."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numba import njit
from report import Row, at_least, at_most

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests" / "orchestrator"))

from native_fmu import build  # noqa: E402

from tlpsim.orchestrator.execution import Master, run  # noqa: E402
from tlpsim.orchestrator.fmi.opening import open_fmu  # noqa: E402
from tlpsim.orchestrator.loop.native import call_step, call_values  # noqa: E402
from tlpsim.orchestrator.ssp.annotations import SystemDescription  # noqa: E402
from tlpsim.orchestrator.system import Component, Connection, System  # noqa: E402
from tlpsim.scenarios.generic import run_system  # noqa: E402

ECOS = "TLPSIM_ECOS_PYTHON"
"""Variable of the environment: Python of an environment that has ecospy, tbb, pythonfmu and numpy."""
STEP = 1000  # ns: the outputs then change over all steps, and all their digits
INPUTS, OUTPUTS = 6, 12
_BUILD = "import sys; from pythonfmu.builder import FmuBuilder; FmuBuilder.build_FMU(sys.argv[1], dest=sys.argv[2])"
_REPETITIONS = 5


def chain(path: Path, ring: bool = False, count: int = 3, step: int = STEP) -> System:
    """Chain of one FMU: output k of one goes to input k of the next, for all six; the first one has constant inputs."""
    wires = [(k, (k + 1) % count) for k in range(count if ring else count - 1)]
    return System(
        components=tuple(
            Component(
                instance=open_fmu(f"c{k}", path),
                step=step,
                parameters={f"u[{i + 1}]": 1.0 + 0.1 * i for i in range(INPUTS)},
                outputs=tuple(f"y[{i + 1}]" for i in range(OUTPUTS)),
            )
            for k in range(count)
        ),
        connections=tuple(
            Connection(
                source=f"c{a}",
                source_variable=f"y[{i + 1}]",
                target=f"c{b}",
                target_variable=f"u[{i + 1}]",
                suppress_unit_conversion=True,
            )
            for a, b in wires
            for i in range(INPUTS)
        ),
    )


def per_step(work: Callable[[int], object], steps: int) -> float:
    """Wall time a step in µs: the median difference of runs of many steps and of few."""
    walls = []
    for _ in range(_REPETITIONS):
        parts = []
        for count in (steps // 10, steps):
            began = time.perf_counter()
            work(count)
            parts.append(time.perf_counter() - began)
        walls.append((parts[1] - parts[0]) / (steps - steps // 10))
    return 1e6 * statistics.median(walls)


def ours(path: Path, steps: int, destination: Path | None = None) -> float:
    """µs a macro step, with all outputs in an HDF5 file where a destination is given."""

    def work(count: int) -> None:
        if destination is None:
            run(chain(path), count * STEP)
        else:
            description = SystemDescription(name="chain", system=chain(path))
            run_system(description, destination, stop=count * STEP * 1e-9)

    work(1000)
    return per_step(work, steps)


@njit
def _bare(calls, references, buffers, count):  # type: ignore[no-untyped-def]
    """The calls of a chain of three and nothing else."""
    flags = np.zeros(8)
    for step in range(count):
        for k in range(3):
            if k > 0:
                for i in range(6):
                    buffers[k, i] = buffers[k - 1, 6 + i]
            address = buffers[k].ctypes.data
            call_values(2, calls[k, 1], calls[k, 0], references[0].ctypes.data, 6, address, 6)
            call_step(2, calls[k, 2], calls[k, 0], step * 1e-6, 1e-6, 1, flags.ctypes.data)
            call_values(2, calls[k, 3], calls[k, 0], references[1].ctypes.data, 12, address + 48, 12)


def bare(path: Path, steps: int) -> float:
    """µs a macro step of a compiled loop that only calls the three FMUs and copies their values."""
    names = [f"u[{k + 1}]" for k in range(INPUTS)], [f"y[{k + 1}]" for k in range(OUTPUTS)]
    instances = [open_fmu(f"c{k}", path) for k in range(3)]
    rows = []
    for instance in instances:
        instance.set_parameters({"u[1]": 1.0})
        instance.bind(*names)
        instance.enter_initialization(0.0)
        instance.exit_initialization()
        found = instance.native_calls()
        assert found is not None
        rows.append((found.instance, found.set_values, found.do_step, found.get_values))
    assert found is not None
    references = np.zeros((2, OUTPUTS), dtype=np.uint32)
    references[0, :INPUTS], references[1] = found.input_references, found.output_references
    calls, buffers = np.array(rows, dtype=np.int64), np.ones((3, INPUTS + OUTPUTS))
    _bare(calls, references, buffers, 10)
    result = per_step(lambda count: _bare(calls, references, buffers, count), steps)
    for instance in instances:
        instance.free()
    return result


_ECOS_RUN = """
import os, statistics, sys, time
from ecospy import EcosSimulation, EcosSimulationStructure
path, steps, csv = sys.argv[1], int(sys.argv[2]), sys.argv[3]
with EcosSimulationStructure() as structure:
    for k in range(3):
        structure.add_model(f"c{k}", path)
    for k in range(2):
        for i in range(1, 7):
            structure.make_real_connection(f"c{k}::y[{i}]", f"c{k + 1}::u[{i}]")
    structure.add_parameter_set("start", {f"c{k}::u[{i + 1}]": 1.0 + 0.1 * i for k in range(3) for i in range(6)})
    with EcosSimulation(structure=structure, step_size=1e-6) as simulation:
        if csv:
            simulation.add_csv_writer(csv, identifiers=[f"c{k}::y[{i}]" for k in range(3) for i in range(1, 13)])
        simulation.init(parameter_set="start")
        simulation.step(100)
        walls = []
        for _ in range(5):
            began = time.perf_counter()
            simulation.step(steps)
            walls.append((time.perf_counter() - began) / steps)
        if not simulation.get_real("c2::y[1]") > 0.0:
            sys.exit("nothing went through the chain")
        simulation.terminate()
if csv and os.path.getsize(csv) < steps:
    sys.exit("nothing was recorded")
print(1e6 * statistics.median(walls), flush=True)
os._exit(0)
"""


def ecos(path: Path, steps: int, csv: str, folder: Path) -> list[float] | str:
    """µs a macro step of ecos in each of several processes, in ascending order, or why there are none."""
    python = os.environ.get(ECOS)
    if not python:
        return "ecos: not installed"
    package = folder / "path" / "tlpsim"
    if not package.exists():
        package.mkdir(parents=True)
        for room in ("loads", "fmus"):
            (package / room).symlink_to(ROOT / room)
    library = Path(python).absolute().parent.parent / "lib"  # tbb puts its libraries there
    places = {"PYTHONPATH": str(package.parent), "LD_LIBRARY_PATH": str(library)}
    command = [python, "-c", _ECOS_RUN, str(path), str(steps), csv]
    found = []
    for _ in range(_REPETITIONS):
        done = subprocess.run(command, env={**os.environ, **places}, capture_output=True, text=True, check=False)
        if done.returncode or not done.stdout.split():
            lines = (done.stderr or done.stdout).strip().splitlines() or [f"exit code {done.returncode}"]
            return f"ecos: {lines[-1][:80]}"
        found.append(float(done.stdout.split()[-1]))
    return sorted(found)


def python_fmu(folder: Path) -> Path:
    """The FMU of `chain_component`."""
    path = folder / "ChainComponent.fmu"
    command = [sys.executable, "-c", _BUILD, str(Path(__file__).with_name("chain_component.py")), str(path)]
    subprocess.run(command, check=True, capture_output=True, text=True, cwd=folder)
    return path


def speed(quick: bool) -> Sequence[Row]:
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        native, python = build(folder), python_fmu(folder)
        factor = 1 if quick else 5
        floor = bare(native, 200_000 * factor)
        rows.append(Row(item="calls of three native FMUs and nothing else", measured=f"{floor:.3f} µs"))
        cases = (
            ("three native FMUs", native, 200_000 * factor, 0.25, 20_000),
            ("three Python FMUs", python, 5_000 * factor, 12.0, 1_000),
        )
        for kind, path, steps, bound, theirs in cases:
            for recording, largest in (("", bound), (", all outputs recorded", 1.0 if path == native else None)):
                destination = folder / "results.h5" if recording else None
                count = min(steps, 100_000 * factor) if recording else steps
                own = ours(path, count, destination)
                item = f"{kind}{recording}: wall time a macro step"
                measured = Row(item=item, measured=f"{own:.3f} µs")
                rows.append(measured if largest is None else at_most(item, own, largest, "µs", ".3f"))
                other = ecos(path, theirs * factor, str(folder / "ecos.csv") if recording else "", folder)
                item = f"{kind}{recording}: ecos over that"
                if isinstance(other, str):
                    rows.append(Row(item=item, measured=other))
                else:
                    middle = statistics.median(other)
                    item = f"{item}, median of {len(other)} processes of {other[0]:.3g} to {other[-1]:.3g} µs"
                    rows.append(at_least(item, middle / own, 5.0, "times", ".1f"))
    return rows


def large_systems(quick: bool) -> Sequence[Row]:
    """Chains and rings of up to a hundred."""
    rows = []
    step = 100_000_000  # ns; with a short one the last of a chain get numbers too small for their full digits
    with tempfile.TemporaryDirectory() as name:
        native = build(name)
        for ring in (False, True):
            costs = []
            for count in (3, 100):
                steps = (100_000 if quick else 500_000) // count
                system = chain(native, ring, count, step)
                master = Master(system)
                master.initialize()
                walls = []
                for part in range(1, 7):
                    began = time.perf_counter()
                    master.advance(part * steps * step)
                    walls.append(time.perf_counter() - began)
                costs.append(1e6 * statistics.median(walls[1:]) / (steps * count))
                for component in system.components:
                    component.instance.free()
            item = f"native FMUs in a {'ring' if ring else 'chain'}: time a component step, 100 over 3 of them"
            rows.append(at_most(f"{item} ({costs[1]:.3f} µs)", costs[1] / costs[0], 2.0, "times", ".2f"))
    return rows
