"""From a file of the standard SSP to a system that the master steps.

Nested systems are resolved: names of their components are joined by dots, connectors of systems become connections
from component to component with all transformations on the way, and parameters come down to the components they are
for. Bindings of an outer system go over those of an inner one, later ones over earlier ones (SSP 1.0, section 5.3.2).
Version 2.0 is read as far as its elements are those of 1.0, with the types of FMI 3.0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any
from urllib.parse import unquote, urlsplit

from tlpsim.orchestrator.archive import Element, read_xml, unpacked
from tlpsim.orchestrator.clock import to_positive_ticks
from tlpsim.orchestrator.fmi.description import read_description
from tlpsim.orchestrator.instance import Instance, nearest_match
from tlpsim.orchestrator.ssp.annotations import (
    ANNOTATION_TYPE,
    DESCRIPTION,
    SSD,
    SspError,
    SystemDescription,
    attribute,
    child,
    children,
    flag,
    linear_transformation,
    local_name,
    number,
    own_annotation,
)
from tlpsim.orchestrator.ssp.parameters import Leg, Place, Port, Value, parametrized, read_bindings
from tlpsim.orchestrator.system import Component, Connection, Iteration, System

_FMU = "application/x-fmu-sharedlibrary"
_COMPONENT_KEYS = ("step", "inputsAt", "outputs")
_CONNECTION_KEYS = ("filter", "extrapolation")
_MASTER_KEYS = ("algorithm", *(each.name for each in fields(Iteration)))
_VERSIONS = ("1.0", "2.0")
_DEEPEST = 100
_GIVING, _TAKING = ("output", "calculatedParameter"), ("input", "parameter")

OpenComponent = Callable[[str, Path], Instance]


@dataclass(slots=True, kw_only=True)
class _Reader:
    """What is collected on the way through the hierarchy of a file."""

    file: Path
    folder: Path
    enclosed: bool
    open_component: OpenComponent
    default_step: float | None
    steps: Mapping[str, float]
    instances: dict[Place, Instance] = field(default_factory=dict)
    components: dict[Place, Component] = field(default_factory=dict)
    connectors: dict[Place, dict[str, str]] = field(default_factory=dict)
    values: list[tuple[Place, str, Value]] = field(default_factory=list)
    connections: list[tuple[Place, Element]] = field(default_factory=list)

    def file_of(self, uri: str, where: str) -> Path:
        """Path of the file that a URI relative to the description names."""
        try:
            parts = urlsplit(uri)
        except ValueError as error:
            raise SspError(f"{where}: the source '{uri}' is no URI: {error}; give the path of a file") from None
        if parts.scheme not in ("", "file") or parts.netloc or parts.fragment or not parts.path:
            raise SspError(f"{where}: the source '{uri}' is not a file relative to the description; give its path")
        try:
            path = (self.folder / unquote(parts.path)).resolve()
            found = path.is_file()
        except (OSError, ValueError) as error:
            raise SspError(f"{where}: the source '{uri}' is no path: {error}; give that of a file") from None
        if self.enclosed and not path.is_relative_to(self.folder):
            raise SspError(f"{where}: the source '{uri}' leads out of the package; put the file into resources/")
        if not found:
            raise SspError(f"{where}: there is no file '{uri}'; the folder is {self.folder}")
        return path

    def load(self, element: Element, where: str) -> Element:
        """Root of the XML file that an element's source names."""
        uri = element.get("source", "")
        try:
            return read_xml(self.file_of(uri, where).read_bytes(), f"{self.file}: {uri}", SspError)
        except OSError as error:
            raise SspError(f"{where}: '{uri}' cannot be read: {error.strerror}") from error


def read_ssp(
    path: str | Path,
    open_component: OpenComponent,
    step: float | None = None,
    steps: Mapping[str, float] = MappingProxyType({}),
) -> SystemDescription:
    """Read a system description.

    Parameters
    ----------
    path
        An .ssd file, or an .ssp file, which is extracted to a folder that is removed when the process ends.
    open_component
        Makes an instance of a name and the path of an FMU.
    step
        Step in s of the components for which the file gives none; without it that of their FMUs' default experiments
        holds.
    steps
        Steps in s by component, which go over those of the file.

    Raises
    ------
    SspError
        If the file is missing or malformed, has an element that is not supported, or leaves a step open.
    FmuError
        If an FMU cannot be read.
    WiringError
        If a step is not a positive whole number of nanoseconds.
    """
    reader = _reader(Path(path), open_component, step, steps)
    where = str(path)
    data = reader.folder / (DESCRIPTION if reader.enclosed else reader.file.name)
    try:
        root = read_xml(data.read_bytes(), where, SspError)
    except OSError as error:
        missing = f"the archive has no {DESCRIPTION}" if reader.enclosed else f"cannot be read: {error.strerror}"
        raise SspError(f"{where}: {missing}; give a system description of the standard SSP") from None
    if root.tag != f"{{{SSD}}}SystemStructureDescription":
        raise SspError(f"{where}: the document is <{local_name(root)}>, not <SystemStructureDescription> of {SSD}")
    if root.get("version") not in _VERSIONS:
        raise SspError(f"{where}: version = '{root.get('version')}' is not one of {', '.join(_VERSIONS)}")
    top = child(root, "System")
    if top is None:
        raise SspError(f"{where}: the description has no <System>; add one")
    try:
        _walk(reader, top, ())
        connections, found = _connect(reader)
        parameters, notes = parametrized(reader.instances, reader.connectors, reader.values, found)
    except BaseException:
        for instance in reader.instances.values():
            instance.free()
        raise
    experiment = child(root, "DefaultExperiment")
    algorithm, iteration = _master(root, where)
    return SystemDescription(
        name=root.get("name") or reader.file.stem,
        system=System(
            components=tuple(replace(each, parameters=parameters[path]) for path, each in reader.components.items()),
            connections=connections,
            algorithm=algorithm,
            iteration=iteration,
        ),
        start=None if experiment is None else number(experiment, "startTime", where),
        stop=None if experiment is None else number(experiment, "stopTime", where),
        notes=tuple(notes),
    )


def _reader(file: Path, open_component: OpenComponent, step: float | None, steps: Mapping[str, float]) -> _Reader:
    enclosed = file.suffix.lower() == ".ssp"
    if not enclosed and file.suffix.lower() != ".ssd":
        raise SspError(f"{file}: '{file.suffix}' is no system description; give an .ssp or an .ssd file")
    if not file.is_file():
        raise SspError(f"{file}: no such file; give the path of an .ssp or an .ssd file")
    folder = unpacked(file, "tlpsim_ssp_", SspError) if enclosed else file.parent
    return _Reader(
        file=file,
        folder=folder.resolve(),
        enclosed=enclosed,
        open_component=open_component,
        default_step=step,
        steps=steps,
    )


def _master(root: Element, where: str) -> tuple[str, Iteration]:
    own = own_annotation(root, _MASTER_KEYS, where)
    if own is None:
        return System(components=()).algorithm, Iteration()
    defaults, changes = Iteration(), {}
    for name in _MASTER_KEYS[1:]:
        if name in own.attrib:
            kind = type(getattr(defaults, name))
            try:
                changes[name] = kind(own.get(name))
            except ValueError:
                raise SspError(f"{where}: {name} = '{own.get(name)}' of the master is not a number") from None
    return own.get("algorithm", System(components=()).algorithm), Iteration(**changes)


def _walk(reader: _Reader, system: Element, path: Place) -> None:
    """Collect the elements of a system and of those in it."""
    where = f"{reader.file}: system '{'.'.join(path) or system.get('name', '')}'"
    if len(path) > _DEEPEST:
        raise SspError(f"{where}: systems are nested more than {_DEEPEST} deep; flatten them")
    kinds = {}
    for connector in children(system, "Connectors", "Connector"):
        kinds[attribute(connector, "name", where)] = attribute(connector, "kind", where)
    reader.connectors[path] = kinds
    reader.values += [(path, name, value) for name, value in read_bindings(system, where, reader.load)]
    for elements in children(system, "Elements"):
        for element in elements:
            inner = (*path, attribute(element, "name", where))
            if inner in reader.components or inner in reader.connectors:
                raise SspError(f"{where}: the element '{inner[-1]}' exists twice; give each one its own name")
            if local_name(element) == "System":
                _walk(reader, element, inner)
            elif local_name(element) == "Component":
                _open(reader, element, inner)
            else:
                raise SspError(f"{where}: <{local_name(element)}> '{inner[-1]}' is not supported; connect directly")
    reader.connections += [(path, each) for each in children(system, "Connections", "Connection")]


def _open(reader: _Reader, element: Element, path: Place) -> None:
    """Open the FMU of a component."""
    name = ".".join(path)
    where = f"{reader.file}: component '{name}'"
    if element.get("type", _FMU) != _FMU:
        raise SspError(f"{where}: its type is '{element.get('type')}'; only FMUs, {_FMU}, are supported")
    if element.get("implementation", "any") not in ("any", "CoSimulation"):
        raise SspError(f"{where}: implementation = '{element.get('implementation')}'; only CoSimulation is supported")
    source = reader.file_of(attribute(element, "source", where), where)
    own = own_annotation(element, _COMPONENT_KEYS, where)
    instance = reader.instances[path] = reader.open_component(name, source)
    step = None if own is None else number(own, "step", where)
    step = reader.steps.get(name, reader.default_step if step is None else step)
    if step is None:
        step = read_description(source).default_experiment.get("stepSize")
    if step is None:
        raise SspError(
            f"{where}: neither the file nor the default experiment of the FMU gives a step; give one in the annotation "
            f'{ANNOTATION_TYPE} of the component, <Component step="0.1"/>, or for all components when reading the file'
        )
    outputs = None
    inputs_at = "end"
    if own is not None:
        inputs_at = own.get("inputsAt", inputs_at)
        if own.get("outputs") == "chosen":
            outputs = tuple(attribute(each, "name", where) for each in children(own, "Output"))
    reader.components[path] = Component(
        instance=instance,
        step=to_positive_ticks(step, f"{where}: step"),
        inputs_at=inputs_at,
        outputs=outputs,
    )
    reader.values += [(path, key, value) for key, value in read_bindings(element, where, reader.load)]


def _connect(reader: _Reader) -> tuple[tuple[Connection, ...], dict[Port, list[Leg]]]:
    """Connections of components; and inputs and parameters that connectors of systems feed, with their legs."""
    incoming: dict[Port, Leg] = {}
    for path, element in reader.connections:
        leg, end = _leg(reader, path, element)
        if end in incoming:
            raise SspError(f"{leg.where}: '{_text(end)}' is already fed by '{_text(incoming[end].start)}'; remove one")
        incoming[end] = leg
    connections = []
    open_ends: dict[Port, list[Leg]] = {}
    for end in incoming:
        if end[0] not in reader.components:
            continue
        legs = _traced(reader, incoming, end)
        start = legs[0].start
        if start[0] not in reader.components:
            open_ends[end] = legs
            continue
        if _kind(reader, end) == "parameter":
            raise SspError(
                f"{legs[-1].where}: '{_text(end)}' is a parameter that another component calculates, which is not "
                "supported; set its value"
            )
        factor, offset = 1.0, 0.0
        settings: dict[str, Any] = {}
        for leg in legs:
            factor, offset = leg.factor * factor, leg.factor * offset + leg.offset
            settings |= leg.settings
        connections.append(
            Connection(
                source=".".join(start[0]),
                source_variable=start[1],
                target=".".join(end[0]),
                target_variable=end[1],
                factor=factor,
                offset=offset,
                suppress_unit_conversion=any(leg.suppress_unit_conversion for leg in legs),
                **settings,
            )
        )
    return tuple(connections), open_ends


def _leg(reader: _Reader, path: Place, element: Element) -> tuple[Leg, Port]:
    """A connection in the direction of its signal, and where it ends."""
    ends: list[Port] = []
    where = f"{reader.file}: connection"
    for side in ("start", "end"):
        name = element.get(f"{side}Element")
        place = path if name is None else (*path, name)
        if place not in reader.components and place not in reader.connectors:
            known = [each[-1] for each in (*reader.components, *reader.connectors) if each[:-1] == path and each]
            raise SspError(f"{where}: there is no element '{name}'{nearest_match(name or '', known)}")
        ends.append((place, attribute(element, f"{side}Connector", where)))
    where = f"{where} {_text(ends[0])} -> {_text(ends[1])}"
    kinds = [_kind(reader, end) for end in ends]
    # seen from inside, a connector of the system itself gives what it takes from outside
    gives = [(kind in _GIVING) != (end[0] == path) if kind else None for kind, end in zip(kinds, ends, strict=True)]
    if gives[0] is not None and gives[0] == gives[1]:
        raise SspError(f"{where}: both ends {'give' if gives[0] else 'take'} a value ({kinds[0]}, {kinds[1]})")
    start, end = ends[::-1] if gives[0] is False or gives[1] else ends
    factor, offset = linear_transformation(element, where)
    own = own_annotation(element, _CONNECTION_KEYS, where)
    leg = Leg(
        start=start,
        factor=factor,
        offset=offset,
        suppress_unit_conversion=flag(element, "suppressUnitConversion", where),
        settings={} if own is None else dict(own.items()),
        where=where,
    )
    return leg, end


def _kind(reader: _Reader, port: Port) -> str:
    """Kind of a connector, that of the FMU's variable for a component; "" for a variable that it does not have."""
    path, name = port
    if path in reader.components:
        instance = reader.instances[path]
        names = [name] if name in instance.variables else []
        if name in instance.arrays:
            names = [each for each in instance.variables if each.startswith(f"{name}[")]
        return instance.variables[names[0]].causality if names else ""
    kinds = reader.connectors[path]
    if name not in kinds:
        place = ".".join(path) or "the description"
        raise SspError(f"{reader.file}: system '{place}' has no connector '{name}'{nearest_match(name, kinds)}")
    if kinds[name] not in _GIVING + _TAKING:
        raise SspError(
            f"{reader.file}: connector '{_text(port)}' is of the kind '{kinds[name]}'; "
            f"it must be one of {', '.join(_GIVING + _TAKING)}"
        )
    return kinds[name]


def _traced(reader: _Reader, incoming: dict[Port, Leg], end: Port) -> list[Leg]:
    """The legs that lead to an input, the first one first."""
    legs = [incoming[end]]
    while legs[-1].start[0] not in reader.components and legs[-1].start in incoming:
        legs.append(incoming[legs[-1].start])
        if len(legs) > len(incoming):
            raise SspError(f"{legs[-1].where}: connectors of systems feed each other in a circle; remove a connection")
    return legs[::-1]


def _text(port: Port) -> str:
    return ".".join((*port[0], port[1]))
