"""Base class of the project's FMUs: a pythonfmu slave whose variables live in arrays.

A component declares its variables in one table. The base class derives from it the storage, the vector
get and set (the whole vector in one numpy operation, where pythonfmu calls one closure a variable), the
model description with units, derivatives, output dependencies and initial unknowns, a GUID that changes
only with the interface, and an exact FMU state.
"""

from __future__ import annotations

import atexit
import ctypes
import io
import json
import sys
import warnings
from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any, ClassVar
from uuid import NAMESPACE_URL, uuid5
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from numpy.typing import NDArray
from pythonfmu import Boolean, Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Integer, Real, String
from pythonfmu.enums import Fmi2Status
from pythonfmu.osutil import get_lib_extension, get_platform

from tlpsim.fmus.version import built_version
from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import FmuError

# Exponents of the SI base units, as FMI 2.0 writes them (section 2.2.2).
UNITS: dict[str, dict[str, int]] = {
    "1": {},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "m/s2": {"m": 1, "s": -2},
    "m2": {"m": 2},
    "m3": {"m": 3},
    "m4": {"m": 4},
    "s": {"s": 1},
    "Hz": {"s": -1},
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "rad/s2": {"rad": 1, "s": -2},
    "kg": {"kg": 1},
    "kg.m2": {"kg": 1, "m": 2},
    "kg/m3": {"kg": 1, "m": -3},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "N/s": {"kg": 1, "m": 1, "s": -3},
    "N.m/s": {"kg": 1, "m": 2, "s": -3},
}

KINDS = {"Real": Real, "Integer": Integer, "Boolean": Boolean, "String": String}
_COMPUTED = ("output", "local")


@dataclass(frozen=True, slots=True, kw_only=True)
class Variable:
    """One FMI scalar variable.

    `derivative_of` names the variable whose time derivative this one is. `depends_on` holds patterns of
    the inputs that an output depends on directly at a communication point. A `tunable` parameter can change between
    two steps.
    """

    name: str
    causality: str
    description: str
    unit: str | None = None
    kind: str = "Real"
    start: float | int | bool | str = 0.0
    derivative_of: str | None = None
    depends_on: tuple[str, ...] = ()
    tunable: bool = False

    @property
    def variability(self) -> str:
        """Of FMI: fixed or tunable for parameters, continuous for all else, which is Real."""
        if self.causality != "parameter":
            return "continuous"
        return "tunable" if self.tunable else "fixed"


def six(
    prefix: str,
    causality: str,
    description: str,
    units: tuple[str, str],
    *,
    derivative_of: str | None = None,
    depends_on: tuple[str, ...] = (),
) -> tuple[Variable, ...]:
    """Variables `prefix.surge` … `prefix.yaw`; `units` are those of translations and of rotations."""
    return tuple(
        Variable(
            name=f"{prefix}.{degree}",
            causality=causality,
            description=f"{description}, {degree}",
            unit=units[index // 3],
            derivative_of=f"{derivative_of}.{degree}" if derivative_of else None,
            depends_on=depends_on,
        )
        for index, degree in enumerate(DEGREES_OF_FREEDOM)
    )


def real_parameter(name: str, unit: str, start: float, description: str, *, tunable: bool = False) -> Variable:
    """Real parameter with a unit."""
    return Variable(name=name, causality="parameter", unit=unit, start=start, description=description, tunable=tunable)


def integer_parameter(name: str, start: int, description: str) -> Variable:
    """Integer parameter."""
    return Variable(name=name, causality="parameter", kind="Integer", start=start, description=description)


def boolean_parameter(name: str, start: bool, description: str) -> Variable:
    """Boolean parameter."""
    return Variable(name=name, causality="parameter", kind="Boolean", start=start, description=description)


def text_parameter(name: str, start: str, description: str, *, tunable: bool = False) -> Variable:
    """String parameter."""
    return Variable(
        name=name, causality="parameter", kind="String", start=start, description=description, tunable=tunable
    )


class Component(Fmi2Slave):
    """An FMU whose variables are the rows of the class's `table`.

    A subclass gives `table` and four methods: `prepare` builds the model from the parameters, `start` sets
    the outputs at the start time, `advance` takes one communication step, and `snapshot` and `restore` give
    and take back every array that changes while stepping. One with tunable parameters gives `retune` as well.
    Inputs hold the values at the end of the communication step when `advance` is called.
    """

    table: ClassVar[tuple[Variable, ...]]
    author = "The tlpsim developers"
    license = "Apache-2.0"

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.version = built_version(Path(str(self.resources)))
        self.guid = uuid5(NAMESPACE_URL, f"tlpsim/{self.version}/{type(self).__name__}/{self.table!r}")
        self.values: NDArray[np.float64] = np.zeros(len(self.table))
        self.settings: dict[int, float | int | bool | str] = {}
        self.references = {variable.name: index for index, variable in enumerate(self.table)}
        self.start_time = 0.0
        self._prepared = self._current = self._stepping = self._tuned = False
        self._first_parameter = next(
            (i for i, variable in enumerate(self.table) if variable.causality == "parameter"), len(self.table)
        )
        for reference, variable in enumerate(self.table):
            self._register(reference, variable)
        _release_library_at_exit(Path(str(self.resources)), type(self).__name__)

    def _register(self, reference: int, variable: Variable) -> None:
        if variable.kind == "Real":
            self.values[reference] = float(variable.start)
        else:
            self.settings[reference] = variable.start
        computed = variable.causality in _COMPUTED
        self.register_variable(
            KINDS[variable.kind](
                variable.name,
                causality=Fmi2Causality[variable.causality],
                variability=Fmi2Variability[variable.variability],
                initial=Fmi2Initial.calculated
                if computed
                else (Fmi2Initial.exact if variable.causality == "parameter" else None),
                description=variable.description,
                getter=lambda: None,
                setter=lambda value: None,
            ),
            nested=False,
        )

    # What a subclass gives

    @abstractmethod
    def prepare(self) -> None:
        """Build the model from the parameters; called before `start` and after a parameter was changed."""

    @abstractmethod
    def start(self, time: float) -> None:
        """Set the outputs at the start time from the inputs."""

    @abstractmethod
    def advance(self, time: float, step: float) -> None:
        """Step from `time` to `time + step` and set the outputs there."""

    def retune(self) -> None:
        """Take over tunable parameters that changed; called before the next step."""

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """Copies of all arrays that change while stepping, beside the variables themselves."""
        return {}

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Take back what `snapshot` gave."""

    # What a subclass uses

    def view(self, prefix: str) -> NDArray[np.float64]:
        """Writable view of the consecutive Real variables whose names start with `prefix`."""
        found = [i for i, variable in enumerate(self.table) if variable.name.startswith(prefix)]
        if not found or found != list(range(found[0], found[0] + len(found))):
            raise FmuError(f"{type(self).__name__}: the variables {prefix}* are not consecutive in the table")
        return self.values[found[0] : found[-1] + 1]

    def parameter(self, name: str) -> Any:
        """Value of a parameter of any kind, by name."""
        reference = self.references[name]
        return self.settings.get(reference, float(self.values[reference]))

    # FMI calls, made by pythonfmu's library

    def setup_experiment(self, start_time: float, stop_time: float | None, tolerance: float | None) -> None:
        """Keep the start time."""
        self.start_time = start_time

    def exit_initialization_mode(self) -> None:
        """Prepare the model where nobody asked for outputs before."""
        self._refresh()
        self._stepping = True

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Take one communication step."""
        if self._tuned:
            self.retune()
            self._tuned = False
        self.advance(current_time, step_size)
        return True

    def get_real(self, vrs: list[int]) -> list[float]:
        """Values by value reference, in one operation."""
        if not self._stepping:
            self._refresh(vrs)
        return self.values[vrs].tolist()

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set values by value reference, in one operation."""
        self._touched(vrs)
        self.values[vrs] = values

    def _get_settings(self, vrs: list[int]) -> list[Any]:
        return [self.settings[reference] for reference in vrs]

    def _set_settings(self, vrs: list[int], values: list[Any]) -> None:
        self._touched(vrs)
        self.settings.update(zip(vrs, values, strict=True))

    get_integer = get_boolean = get_string = _get_settings
    set_integer = set_boolean = set_string = _set_settings

    def _touched(self, vrs: list[int]) -> None:
        parameters = [self.table[reference] for reference in vrs if reference >= self._first_parameter]
        if self._stepping:
            fixed = [each.name for each in parameters if not each.tunable]
            if fixed:
                raise FmuError(
                    f"{self.instance_name}: parameter {fixed[0]} is fixed; set it before initialization ends"
                )
            self._tuned = self._tuned or bool(parameters)
            return
        self._current = False
        self._prepared = self._prepared and not parameters

    def _refresh(self, vrs: Iterable[int] | None = None) -> None:
        """Bring the outputs up to date with inputs and parameters before the first step."""
        if vrs is not None and not any(self.table[reference].causality in _COMPUTED for reference in vrs):
            return
        if not self._prepared:
            self._prepare_and_log()
            self._prepared = True
        if not self._current:
            self.start(self.start_time)
            self._current = True

    def _prepare_and_log(self) -> None:
        """Build the model; what it warns of, such as a filter that fits poorly, goes to the FMI log."""
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", UserWarning)
            self.prepare()
        for warning in caught:
            self.log(str(warning.message), Fmi2Status.warning)

    # FMU state

    def _get_fmu_state(self) -> dict[str, NDArray[Any]]:
        flags = [self._prepared, self._current, self._stepping, self._tuned]
        state: dict[str, NDArray[Any]] = {
            "values": self.values.copy(),
            "settings": _packed(self.settings),
            "flags": np.array(flags),
            "start_time": np.array(self.start_time),
        }
        if self._prepared:
            state |= {f"model.{name}": array for name, array in self.snapshot().items()}
        return state

    def _set_fmu_state(self, state: dict[str, NDArray[Any]]) -> None:
        parameters = slice(self._first_parameter, None)
        same_model = (
            self._prepared
            and np.array_equal(self.values[parameters], state["values"][parameters])
            and np.array_equal(_packed(self.settings), state["settings"])
        )
        self.values[:] = state["values"]
        self.settings = {int(k): v for k, v in json.loads(state["settings"].tobytes()).items()}
        self.start_time = float(state["start_time"])
        prepared, self._current, self._stepping, self._tuned = (bool(flag) for flag in state["flags"])
        if prepared:
            if not same_model:
                self._prepare_and_log()
            prefix = "model."
            self.restore({k.removeprefix(prefix): v for k, v in state.items() if k.startswith(prefix)})
            self.values[:] = state["values"]
        self._prepared = prepared

    @staticmethod
    def _fmu_state_to_bytes(state: dict[str, NDArray[Any]]) -> bytes:
        buffer = io.BytesIO()
        np.savez(buffer, allow_pickle=False, **state)
        return buffer.getvalue()

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, NDArray[Any]]:
        with np.load(io.BytesIO(bytes(state)), allow_pickle=False) as arrays:
            return dict(arrays)

    # Model description

    def to_xml(self, model_options: dict[str, str] | None = None) -> Element:
        """Model description with what pythonfmu leaves out: units, derivatives, dependencies, unknowns."""
        root = super().to_xml(model_options or {})
        # The build's date would make each build another file; the version says what it is.
        root.attrib.pop("generationDateAndTime", None)
        root.set("generationTool", f"tlpsim {self.version}, {root.get('generationTool')}")
        root.insert(list(root).index(_child(root, "CoSimulation")) + 1, self._unit_definitions())
        for variable, scalar in zip(self.table, _child(root, "ModelVariables"), strict=True):
            if variable.unit is not None:
                scalar[0].set("unit", variable.unit)
            if variable.derivative_of is not None:
                scalar[0].set("derivative", str(self.references[variable.derivative_of] + 1))
        root.remove(_child(root, "ModelStructure"))
        root.append(self._model_structure())
        return root

    def _unit_definitions(self) -> Element:
        definitions = Element("UnitDefinitions")
        for unit in sorted({variable.unit for variable in self.table if variable.unit}):
            node = SubElement(definitions, "Unit", name=unit)
            SubElement(node, "BaseUnit", {base: str(power) for base, power in UNITS[unit].items()})
        return definitions

    def _model_structure(self) -> Element:
        structure = Element("ModelStructure")
        for section in ("Outputs", "InitialUnknowns"):
            node = SubElement(structure, section)
            for index, variable in enumerate(self.table):
                if variable.causality == "output":
                    known = " ".join(str(i + 1) for i in self._dependencies(variable))
                    SubElement(node, "Unknown", index=str(index + 1), dependencies=known)
        return structure

    def _dependencies(self, output: Variable) -> Sequence[int]:
        return [
            index
            for index, variable in enumerate(self.table)
            if variable.causality == "input"
            and any(fnmatchcase(variable.name, pattern) for pattern in output.depends_on)
        ]


@cache
def _release_library_at_exit(resources: Path, identifier: str) -> None:
    """Let pythonfmu's library release its state while Python still runs.

    pythonfmu 0.7 otherwise releases it twice when a Python process ends, which now and then aborts the process. In a
    tool that is not Python itself (no command line) the library owns the interpreter, and is left alone.
    """
    library = resources.parent / "binaries" / get_platform() / f"{identifier}.{get_lib_extension()}"
    if sys.orig_argv and library.is_file():
        atexit.register(ctypes.CDLL(str(library)).finalizePythonInterpreter)


def _packed(settings: dict[int, float | int | bool | str]) -> NDArray[np.uint8]:
    return np.frombuffer(json.dumps(settings).encode(), dtype=np.uint8)


def _child(root: Element, tag: str) -> Element:
    child = root.find(tag)
    assert child is not None, f"pythonfmu wrote no {tag}"
    return child
