"""FMUs of others against FMPy's simulation of them.

TLPSIM_REFERENCE_FMUS is a folder of FMUs, such as a release of the Modelica Association's Reference FMUs; those for
co-simulation that have a library for this platform are run at their default step, with their inputs at start values.
"""

import os
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu

from tlpsim.loads.errors import FmuError, StepError
from tlpsim.orchestrator.archive import read_xml
from tlpsim.orchestrator.fmi.description import CO_SIMULATION, library_member, read_description
from tlpsim.orchestrator.fmi.opening import open_fmu

FOLDER = os.environ.get("TLPSIM_REFERENCE_FMUS")
MOST_STEPS = 1000

pytestmark = [
    pytest.mark.validation,
    pytest.mark.skipif(FOLDER is None, reason="TLPSIM_REFERENCE_FMUS names no folder of FMUs"),
]


def paths() -> list[Path]:
    return sorted(Path(FOLDER).rglob("*.fmu")) if FOLDER else []


def is_supported(path: Path) -> bool:
    """Whether the FMU is of a released version 2 or 3, by its own word."""
    with zipfile.ZipFile(path) as archive:
        root = read_xml(archive.read("modelDescription.xml"), str(path))
    return root.get("fmiVersion", "").split(".")[0] in ("2", "3")


@pytest.mark.parametrize("path", paths(), ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_outputs_are_those_of_fmpy(path: Path) -> None:
    if not is_supported(path):
        pytest.skip("of another version of FMI")
    said = read_description(path)
    if CO_SIMULATION not in said.kinds:
        pytest.skip("not for co-simulation")
    try:
        library_member(said)
    except FmuError as error:
        pytest.skip(str(error))
    names = [
        name
        for name, variable in said.variables.items()
        if variable.causality == "output" and variable.type != "String"
    ]
    step = said.default_experiment.get("stepSize", 0.01)
    count = min(MOST_STEPS, round(said.default_experiment.get("stopTime", 1.0) / step))
    instance = open_fmu("reference", path)
    instance.set_parameters({})
    instance.bind([], names)
    instance.enter_initialization(0.0)
    instance.exit_initialization()
    values = np.empty((count + 1, len(names)))
    instance.get_outputs(values[0])
    done = 0
    try:
        for done in range(count):
            instance.step(done * step, step)
            instance.get_outputs(values[done + 1])
        done = count
        instance.terminate()
    except StepError as error:
        # some reference models end the simulation themselves, and FMPy's ends there too
        if "end of the simulation" not in str(error) and "ends the simulation" not in str(error):
            raise
    instance.free()
    outputs = list(dict.fromkeys(said.places[name].variable for name in names))
    result = simulate_fmu(
        str(path),
        fmi_type="CoSimulation",
        stop_time=count * step,
        step_size=step,
        output_interval=step,
        output=outputs,
        validate=False,
        use_event_mode=False,
    )
    assert done <= len(result) <= done + 2
    samples = min(done + 1, len(result))
    for column, name in enumerate(names):
        place = said.places[name]
        wanted = np.asarray(result[place.variable], dtype=np.float64).reshape(len(result), -1)[:, place.position]
        np.testing.assert_allclose(values[:samples, column], wanted[:samples], rtol=1e-9, atol=1e-12, err_msg=name)
