"""Opening an FMU of any version and kind."""

from pathlib import Path

from tlpsim.orchestrator.fmi.description import CO_SIMULATION, MODEL_EXCHANGE, read_description
from tlpsim.orchestrator.fmi.fmi2 import FmuInstance
from tlpsim.orchestrator.fmi.fmi3 import Fmi3Instance
from tlpsim.orchestrator.fmi.instance_base import FmiInstance
from tlpsim.orchestrator.fmi.model_exchange import Fmi3ModelExchangeInstance, ModelExchangeInstance
from tlpsim.orchestrator.fmi.ode import SolverOptions


def open_fmu(name: str, path: str | Path, kind: str | None = None, solver: SolverOptions | None = None) -> FmiInstance:
    """Make an instance of an FMU of FMI 2.0 or 3.0.

    Parameters
    ----------
    name
        Name of the component.
    path
        Path of the FMU.
    kind
        `tlpsim.orchestrator.fmi.description.CO_SIMULATION` or `MODEL_EXCHANGE`; None for the former where the FMU has
        it.
    solver
        How the differential equations are solved of an FMU for model exchange.

    Raises
    ------
    FmuError
        As `FmiInstance`.
    """
    description = read_description(path)
    if kind is None:
        only = MODEL_EXCHANGE in description.kinds and CO_SIMULATION not in description.kinds
        kind = MODEL_EXCHANGE if only else CO_SIMULATION
    if kind == MODEL_EXCHANGE:
        return (ModelExchangeInstance if description.fmi_major == 2 else Fmi3ModelExchangeInstance)(name, path, solver)
    return (FmuInstance if description.fmi_major == 2 else Fmi3Instance)(name, path)
