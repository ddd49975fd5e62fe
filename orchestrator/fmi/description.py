"""What an FMU of FMI 2.0 or 3.0 says about itself, and where it is extracted.

An FMU is extracted once a process and instantiated as often as wanted: a second copy of the same library in
one process does not work for every FMU.
"""

import hashlib
import re
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import fmpy

from tlpsim.loads.errors import FmuError
from tlpsim.orchestrator.archive import Element, read_xml, unpacked
from tlpsim.orchestrator.fmi.model_variables import Place, read_attribute, read_units, read_variables
from tlpsim.orchestrator.instance import Unit, Variable

CO_SIMULATION = "co-simulation"
MODEL_EXCHANGE = "model exchange"
SCHEDULED_EXECUTION = "scheduled execution"

_KINDS = {"CoSimulation": CO_SIMULATION, "ModelExchange": MODEL_EXCHANGE, "ScheduledExecution": SCHEDULED_EXECUTION}

_LARGEST_XML = 512 << 20
"""Bytes that modelDescription.xml may have, many times those of the largest models; a zip bomb has more."""

# name of FMI 2.0, or of the version that has it -> name of FMI 3.0
_CAPABILITIES = {
    "needsExecutionTool": "needsExecutionTool",
    "canBeInstantiatedOnlyOncePerProcess": "canBeInstantiatedOnlyOncePerProcess",
    "canGetAndSetFMUstate": "canGetAndSetFMUState",
    "canSerializeFMUstate": "canSerializeFMUState",
    "providesDirectionalDerivative": "providesDirectionalDerivatives",
    "canHandleVariableCommunicationStepSize": "canHandleVariableCommunicationStepSize",
    "canInterpolateInputs": "canInterpolateInputs",
    "canReturnEarlyAfterIntermediateUpdate": "canReturnEarlyAfterIntermediateUpdate",
    "mightReturnEarlyFromDoStep": "mightReturnEarlyFromDoStep",
    "hasEventMode": "hasEventMode",
    "completedIntegratorStepNotNeeded": "needsCompletedIntegratorStep",
}
_NEGATED = "completedIntegratorStepNotNeeded"


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """One of the interfaces that an FMU has.

    Parameters
    ----------
    model_identifier
        Name of its shared library, without the ending.
    capabilities
        Flags by name, under the names of FMI 2.0 where that has them.
    max_output_derivative_order
        Order up to which derivatives of outputs can be had.
    """

    model_identifier: str
    capabilities: Mapping[str, bool]
    max_output_derivative_order: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class FmuDescription:
    """What an FMU says about itself.

    Parameters
    ----------
    path
        Resolved path of the FMU.
    sha256
        Digest of the FMU file.
    model_name, generation_tool, fmi_version, version, description
        Attributes of the model description; empty when absent.
    guid
        The guid of FMI 2.0, the instantiationToken of FMI 3.0.
    kinds
        Interfaces by kind: `CO_SIMULATION`, `MODEL_EXCHANGE`, `SCHEDULED_EXECUTION`.
    binaries
        Members of the folder binaries, such as ``binaries/linux64/model.so``.
    variables, arrays, units
        As the attributes of `tlpsim.orchestrator.instance.Instance`.
    places
        Value references and types by variable name.
    state_derivatives
        Names of the derivatives of the continuous states, in their order; empty where not declared.
    event_indicators
        Number of event indicators.
    log_categories
        Names of the categories of log messages.
    default_experiment
        Attributes of the default experiment in s, such as ``stepSize``, as far as given.
    """

    path: Path
    sha256: str
    model_name: str
    guid: str
    generation_tool: str
    fmi_version: str
    version: str
    description: str
    kinds: Mapping[str, Kind]
    binaries: frozenset[str]
    variables: Mapping[str, Variable]
    arrays: Mapping[str, tuple[int, ...]]
    units: Mapping[str, Unit]
    places: Mapping[str, Place]
    state_derivatives: tuple[str, ...]
    event_indicators: int
    log_categories: tuple[str, ...]
    default_experiment: Mapping[str, float]

    @property
    def capabilities(self) -> Mapping[str, bool]:
        """Flags of co-simulation, or of the first kind that there is."""
        return (self.kinds.get(CO_SIMULATION) or next(iter(self.kinds.values()))).capabilities

    @property
    def fmi_major(self) -> int:
        """2 or 3."""
        return int(self.fmi_version[0])


def _kind(element: Element, where: str) -> Kind:
    def flag(name: str, name_in_3: str) -> bool:
        if name == _NEGATED and element.get(name_in_3) is not None:
            return element.get(name_in_3) in ("false", "0")
        return element.get(name, element.get(name_in_3)) in ("true", "1")

    return Kind(
        model_identifier=element.get("modelIdentifier", ""),
        capabilities={name: flag(name, name_in_3) for name, name_in_3 in _CAPABILITIES.items()},
        max_output_derivative_order=read_attribute(
            element, "maxOutputDerivativeOrder", int, f"{where}: {element.tag}", 0
        ),
    )


def _parse_description(path: Path, digest: str, xml: bytes, binaries: frozenset[str]) -> FmuDescription:
    """Make a record of modelDescription.xml, as leniently as real FMUs ask for."""
    root = read_xml(xml, f"{path}: modelDescription.xml")
    fmi_version = root.get("fmiVersion", "")
    if not re.fullmatch(r"2\.0(\.\d+)?|3\.\d+(\.\d+)?", fmi_version):
        raise FmuError(f"{path}: the FMU is of FMI version {fmi_version or 'unknown'}; only 2.0 and 3.0 are supported")
    version = int(fmi_version[0])
    kinds = {_KINDS[item.tag]: _kind(item, str(path)) for item in root if item.tag in _KINDS}
    if not kinds:
        raise FmuError(f"{path}: the FMU is neither for co-simulation nor for model exchange; export it again")
    found = read_variables(root, str(path), version)
    experiment = root.find("DefaultExperiment")
    attributes = {} if experiment is None else experiment.attrib
    return FmuDescription(
        path=path,
        sha256=digest,
        model_name=root.get("modelName", ""),
        guid=root.get("guid" if version == 2 else "instantiationToken", ""),
        generation_tool=root.get("generationTool", ""),
        fmi_version=fmi_version,
        version=root.get("version", ""),
        description=root.get("description", ""),
        kinds=kinds,
        binaries=binaries,
        variables=found.variables,
        arrays=found.arrays,
        units=read_units(root, str(path)),
        places=found.places,
        state_derivatives=found.state_derivatives,
        event_indicators=found.event_indicators,
        log_categories=tuple(item.get("name", "") for item in root.iterfind("LogCategories/Category")),
        default_experiment={
            name: read_attribute(experiment, name, float, f"{path}: DefaultExperiment", None)
            for name in ("startTime", "stopTime", "tolerance", "stepSize")
            if experiment is not None and name in attributes
        },
    )


_descriptions: dict[tuple[Path, int, int], FmuDescription] = {}
_extractions: dict[str, Path] = {}


def read_description(path: str | Path) -> FmuDescription:
    """Read an FMU's model description. The file is read again only when it changed.

    Raises
    ------
    FmuError
        If the file is missing, is not a zip file or a damaged one, has no modelDescription.xml, is not of FMI 2.0 or
        3.0, or its model description is malformed.
    """
    try:
        resolved = Path(path).expanduser().resolve()
        stat = resolved.stat()
    except OSError as error:
        raise FmuError(f"{path}: the FMU cannot be opened: {error.strerror}") from error
    except (ValueError, RuntimeError) as error:  # a zero in it, or the home of nobody
        raise FmuError(f"{path}: the FMU cannot be opened: {error}; give the path of a file") from error
    key = (resolved, stat.st_mtime_ns, stat.st_size)
    if key not in _descriptions:
        try:
            with resolved.open("rb") as file:
                digest = hashlib.file_digest(file, "sha256").hexdigest()
            with zipfile.ZipFile(resolved) as archive:
                size = archive.getinfo("modelDescription.xml").file_size
                if size > _LARGEST_XML:
                    raise FmuError(f"{path}: modelDescription.xml has {size} bytes and may have {_LARGEST_XML}")
                xml = archive.read("modelDescription.xml")
                binaries = frozenset(name for name in archive.namelist() if name.startswith("binaries/"))
        except FmuError:
            raise
        except KeyError as error:
            raise FmuError(f"{path}: the file holds no modelDescription.xml, so it is not an FMU") from error
        except OSError as error:
            raise FmuError(f"{path}: the FMU cannot be read: {error.strerror or error}") from error
        except Exception as error:  # a damaged file raises many kinds: BadZipFile, zlib.error, RuntimeError ...
            raise FmuError(f"{path}: the file is not an FMU, or damaged: {error}; export it again") from error
        _descriptions[key] = _parse_description(resolved, digest, xml, binaries)
    return _descriptions[key]


def extracted(description: FmuDescription) -> Path:
    """Return the folder with the extracted FMU, which all its instances share and which is removed at exit.

    Copies of one FMU count as the same one: some cannot be loaded twice.

    Raises
    ------
    FmuError
        As `tlpsim.orchestrator.archive.extract`.
    """
    if description.sha256 not in _extractions:
        _extractions[description.sha256] = unpacked(description.path, "tlpsim_fmu_")
    return _extractions[description.sha256]


def library_member(description: FmuDescription, kind: str = CO_SIMULATION) -> str:
    """Member of the FMU that is the shared library of one of its kinds, for this platform.

    Raises
    ------
    FmuError
        If the FMU is not of this kind, or has no library for this platform.
    """
    path = description.path
    if kind not in description.kinds:
        adapter = (
            "open it with tlpsim.orchestrator.fmi.model_exchange or " if MODEL_EXCHANGE in description.kinds else ""
        )
        raise FmuError(f"{path}: the FMU is for {' and '.join(description.kinds)} only; {adapter}export it for {kind}")
    identifier = description.kinds[kind].model_identifier
    folder = fmpy.platform if description.fmi_major == 2 else fmpy.platform_tuple
    library = f"binaries/{folder}/{identifier}{fmpy.sharedLibraryExtension}"
    if library not in description.binaries:
        platforms = sorted({member.split("/")[1] for member in description.binaries} - {""})
        found = ", ".join(platforms) or "no binaries"
        raise FmuError(f"{path}: no binary {library} for this platform; the FMU has {found}")
    return library
