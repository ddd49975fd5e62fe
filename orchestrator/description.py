"""What an FMI 2.0 co-simulation FMU says about itself, and where it is extracted.

An FMU is extracted once a process and instantiated as often as wanted: a second copy of the same library in
one process does not work for every FMU.
"""

import atexit
import hashlib
import shutil
import tempfile
import xml.etree.ElementTree as ElementTree
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import fmpy

from tlpsim.loads.errors import FmuError
from tlpsim.orchestrator.instance import Variable

_CAPABILITIES = (
    "canHandleVariableCommunicationStepSize",
    "canInterpolateInputs",
    "canBeInstantiatedOnlyOncePerProcess",
    "canGetAndSetFMUstate",
    "canSerializeFMUstate",
    "providesDirectionalDerivative",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FmuDescription:
    """What an FMU says about itself.

    Parameters
    ----------
    path
        Resolved path of the FMU.
    sha256
        Digest of the FMU file.
    model_name, model_identifier, guid, generation_tool, fmi_version, version, description
        Attributes of the model description; empty when absent.
    variables
        Declared variables by name.
    value_references
        Value references by variable name.
    capabilities
        Capability flags of the co-simulation element by name.
    """

    path: Path
    sha256: str
    model_name: str
    model_identifier: str
    guid: str
    generation_tool: str
    fmi_version: str
    version: str
    description: str
    variables: Mapping[str, Variable]
    value_references: Mapping[str, int]
    capabilities: Mapping[str, bool]


_START_CONVERTERS: dict[str, Callable[[str], float | int | bool | str]] = {
    "Real": float,
    "Integer": int,
    "Boolean": lambda text: text in ("true", "1"),
    "String": str,
}


def _variable(element: ElementTree.Element, names: Sequence[str], units: Mapping[str, str]) -> Variable | None:
    """Make a record of a ScalarVariable element; None for a type that the master does not pass on."""
    typed = next((child for child in element if child.tag in _START_CONVERTERS), None)
    if typed is None:
        return None
    start = typed.get("start")
    derivative = typed.get("derivative")
    causality = element.get("causality", "local")
    default_variability = "fixed" if "arameter" in causality else "continuous"
    return Variable(
        name=element.get("name", ""),
        causality=causality,
        variability=element.get("variability", default_variability),
        type=typed.tag,
        unit=typed.get("unit") or units.get(typed.get("declaredType", "")),
        description=element.get("description", ""),
        start=None if start is None else _START_CONVERTERS[typed.tag](start),
        derivative_of=None if derivative is None else names[int(derivative) - 1],
    )


def _parse_description(path: Path, digest: str, xml: bytes, members: set[str]) -> FmuDescription:
    """Make a record of modelDescription.xml, as leniently as real FMUs ask for."""
    try:
        root = ElementTree.fromstring(xml)
    except ElementTree.ParseError as error:
        raise FmuError(f"{path}: modelDescription.xml cannot be parsed: {error}") from error
    fmi_version = root.get("fmiVersion", "")
    if fmi_version != "2.0":
        raise FmuError(f"{path}: the FMU is of FMI version {fmi_version or 'unknown'}; only 2.0 is supported")
    slave = root.find("CoSimulation")
    if slave is None:
        raise FmuError(f"{path}: the FMU is for model exchange only; export it for co-simulation")
    identifier = slave.get("modelIdentifier", "")
    library = f"binaries/{fmpy.platform}/{identifier}{fmpy.sharedLibraryExtension}"
    if library not in members:
        platforms = sorted({member.split("/")[1] for member in members if member.startswith("binaries/")})
        found = ", ".join(platforms) or "no binaries"
        raise FmuError(f"{path}: no binary {library} for this platform; the FMU has {found}")
    units = {
        simple_type.get("name", ""): real.get("unit", "")
        for simple_type in root.iterfind("TypeDefinitions/SimpleType")
        for real in simple_type.iterfind("Real")
    }
    elements = root.findall("ModelVariables/ScalarVariable")
    names = [element.get("name", "") for element in elements]
    try:
        variables = [_variable(element, names, units) for element in elements]
        references = {element.get("name", ""): int(element.get("valueReference", "")) for element in elements}
    except (ValueError, IndexError) as error:
        raise FmuError(f"{path}: modelDescription.xml holds a malformed variable: {error}") from error
    return FmuDescription(
        path=path,
        sha256=digest,
        model_name=root.get("modelName", ""),
        model_identifier=identifier,
        guid=root.get("guid", ""),
        generation_tool=root.get("generationTool", ""),
        fmi_version=fmi_version,
        version=root.get("version", ""),
        description=root.get("description", ""),
        variables={variable.name: variable for variable in variables if variable is not None},
        value_references=references,
        capabilities={name: slave.get(name) in ("true", "1") for name in _CAPABILITIES},
    )


_descriptions: dict[tuple[Path, int, int], FmuDescription] = {}
_extractions: dict[str, Path] = {}


def read_description(path: str | Path) -> FmuDescription:
    """Read an FMU's model description. The file is read again only when it changed.

    Raises
    ------
    FmuError
        If the file is missing, is not a zip file or a damaged one, has no modelDescription.xml, is not an
        FMI 2.0 co-simulation FMU or has no binary for this platform.
    """
    resolved = Path(path).expanduser().resolve()
    try:
        stat = resolved.stat()
    except OSError as error:
        raise FmuError(f"{path}: the FMU cannot be opened: {error.strerror}") from error
    key = (resolved, stat.st_mtime_ns, stat.st_size)
    if key not in _descriptions:
        try:
            digest = hashlib.sha256(resolved.read_bytes()).hexdigest()
            with zipfile.ZipFile(resolved) as archive:
                xml = archive.read("modelDescription.xml")
                members = set(archive.namelist())
        except KeyError as error:
            raise FmuError(f"{path}: the file holds no modelDescription.xml, so it is not an FMU") from error
        except OSError as error:
            raise FmuError(f"{path}: the FMU cannot be read: {error.strerror or error}") from error
        except (zipfile.BadZipFile, zipfile.LargeZipFile, ValueError, NotImplementedError, EOFError) as error:
            raise FmuError(f"{path}: the file is not an FMU, or damaged: {error}; export it again") from error
        _descriptions[key] = _parse_description(resolved, digest, xml, members)
    return _descriptions[key]


def extracted(description: FmuDescription) -> Path:
    """Return the folder with the extracted FMU, which all its instances share and which is removed at exit.

    Copies of one FMU count as the same one: some cannot be loaded twice.
    """
    if description.sha256 not in _extractions:
        folder = Path(tempfile.mkdtemp(prefix="tlpsim_fmu_"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        try:
            with zipfile.ZipFile(description.path) as archive:
                archive.extractall(folder)
        except Exception as error:  # a damaged member raises many kinds: zlib.error, BadZipFile, OSError ...
            shutil.rmtree(folder, ignore_errors=True)
            raise FmuError(f"{description.path}: the FMU cannot be extracted: {error}") from error
        _extractions[description.sha256] = folder
    return _extractions[description.sha256]
