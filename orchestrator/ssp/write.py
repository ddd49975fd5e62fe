"""From a system to a file of the standard SSP 1.0: the description, its FMUs and parameters in ``resources/``."""

from __future__ import annotations

import shutil
import xml.etree.ElementTree as ElementTree
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import fields
from pathlib import Path
from urllib.parse import quote

import numpy as np

from tlpsim.orchestrator.archive import Element
from tlpsim.orchestrator.clock import to_seconds
from tlpsim.orchestrator.instance import Unit, Variable
from tlpsim.orchestrator.ssp.annotations import (
    ANNOTATION_TYPE,
    DESCRIPTION,
    OWN,
    RESOURCES,
    SSC,
    SSD,
    SSV,
    SspError,
    SystemDescription,
)
from tlpsim.orchestrator.system import Component, Connection, Iteration, System, check, expanded
from tlpsim.orchestrator.units import BASE_UNITS, defined

_TOOL = "tlpsim"
_EPOCH = (1980, 1, 1, 0, 0, 0)  # so that equal systems make equal files
_PREFIXES = {"ssd": SSD, "ssc": SSC, "ssv": SSV, "tlpsim": OWN}

Members = dict[str, bytes | Path]
"""Contents of the files of a package by their paths in it: bytes, or the file to copy."""


def write_ssp(description: SystemDescription, path: str | Path) -> Path:
    """Write a system as an .ssp file, or as an .ssd file with the folder ``resources`` beside it.

    Parameters
    ----------
    description
        The system, and start and stop time of its default experiment. Its instances must be FMUs. Connections of arrays
        are written element by element.
    path
        Where to; a file that exists is replaced.

    Raises
    ------
    SspError
        If the ending is another, a component is no FMU, or the file cannot be written.
    WiringError
        As `tlpsim.orchestrator.system.check`.
    """
    path = Path(path)
    if path.suffix.lower() not in (".ssp", ".ssd"):
        raise SspError(f"{path}: a system is written as .ssp or .ssd, not as '{path.suffix}'; change the ending")
    system = expanded(description.system)
    check(system)
    members: Members = {}
    root = _described(description, system, members)
    name = DESCRIPTION if path.suffix.lower() == ".ssp" else path.name
    members = {name: _text(root), **members}
    try:
        if path.suffix.lower() == ".ssp":
            _pack(path, members)
        else:
            for member, content in members.items():
                _place(path.parent / member, content)
    except OSError as error:
        raise SspError(f"{path}: cannot be written: {error.strerror or error}; choose another place") from error
    return path


def _pack(path: Path, members: Members) -> None:
    part = path.with_name(path.name + ".part")
    with zipfile.ZipFile(part, "w") as archive:
        for member, content in members.items():
            data = content if isinstance(content, bytes) else content.read_bytes()
            kind = zipfile.ZIP_STORED if member.endswith(".fmu") else zipfile.ZIP_DEFLATED
            archive.writestr(zipfile.ZipInfo(member, _EPOCH), data, compress_type=kind)
    part.replace(path)


def _place(target: Path, content: bytes | Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    if isinstance(content, bytes):
        target.write_bytes(content)
    elif content.resolve() != target.resolve():
        shutil.copyfile(content, target)


def _text(root: Element) -> bytes:
    for prefix, namespace in _PREFIXES.items():
        ElementTree.register_namespace(prefix, namespace)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)


def _sub(parent: Element, namespace: str, tag: str, attributes: Mapping[str, str] | None = None) -> Element:
    return ElementTree.SubElement(parent, f"{{{namespace}}}{tag}", dict(attributes or {}))


def _described(description: SystemDescription, system: System, members: Members) -> Element:
    """The description, in the order of elements that the schema asks for."""
    head = {"version": "1.0", "name": description.name or "system", "generationTool": _TOOL}
    root = ElementTree.Element(f"{{{SSD}}}SystemStructureDescription", head)
    top = _sub(root, SSD, "System", {"name": "root"})
    elements = _sub(top, SSD, "Elements")
    for component in system.components:
        _component(elements, component, system, members)
    if system.connections:
        connections = _sub(top, SSD, "Connections")
        for connection in system.connections:
            _connection(connections, connection)
    _units(root, system.components)
    experiment = {
        name: repr(float(value))
        for name, value in (("startTime", description.start), ("stopTime", description.stop))
        if value is not None
    }
    if experiment:
        _sub(root, SSD, "DefaultExperiment", experiment)
    master = {"algorithm": system.algorithm}
    defaults = Iteration()
    for each in fields(Iteration):
        value = getattr(system.iteration, each.name)
        if value != getattr(defaults, each.name):
            master[each.name] = str(value)
    _annotate(root, "Master", master)
    return root


def _annotate(parent: Element, tag: str, attributes: Mapping[str, str]) -> Element:
    """Our annotation of an element, for what the standard has no place for."""
    annotation = _sub(_sub(parent, SSD, "Annotations"), SSC, "Annotation", {"type": ANNOTATION_TYPE})
    return _sub(annotation, OWN, tag, attributes)


def _component(elements: Element, component: Component, system: System, members: Members) -> None:
    name = component.name
    fmu = component.instance.describe().get("fmu")
    if not fmu:
        raise SspError(f"component '{name}' is not an FMU, and only FMUs can be written; replace it by one")
    source = quote(_member(Path(fmu), members))
    element = _sub(elements, SSD, "Component", {"name": name, "source": source, "implementation": "CoSimulation"})
    # an input without a connection has no connector: readers may take every connector for connected
    fed = {each.target_variable for each in system.connections if each.target == name}
    connectors = [
        variable
        for variable in component.instance.variables.values()
        if variable.causality == "output"
        or variable.name in fed
        or (variable.causality == "parameter" and variable.name in component.parameters)
    ]
    if connectors:
        group = _sub(element, SSD, "Connectors")
        for variable in connectors:
            connector = _sub(group, SSD, "Connector", {"name": variable.name, "kind": variable.causality})
            _sub(connector, SSC, variable.type, _unit_attribute(variable, component.instance.units))
    if component.parameters:
        file = _free(f"{RESOURCES}/{_plain(name)}.ssv", members)
        members[file] = _text(_parameter_set(component))
        bindings = _sub(element, SSD, "ParameterBindings")
        _sub(bindings, SSD, "ParameterBinding", {"source": quote(file)})
    settings = {"step": repr(to_seconds(component.step)), "inputsAt": component.inputs_at}
    if component.outputs is not None:
        settings["outputs"] = "chosen"
    own_element = _annotate(element, "Component", settings)
    for output in component.outputs or ():
        _sub(own_element, OWN, "Output", {"name": output})


def _member(fmu: Path, members: Members) -> str:
    """Place of an FMU in the package; components of one FMU share it."""
    for member, content in members.items():
        if content == fmu:
            return member
    member = _free(f"{RESOURCES}/{_plain(fmu.stem)}.fmu", members)
    members[member] = fmu
    return member


def _plain(name: str) -> str:
    return "".join(letter if letter.isalnum() or letter in "._-" else "_" for letter in name)


def _free(member: str, members: Members) -> str:
    """A path like the wanted one that no member has yet, also where upper and lower case are the same."""
    taken = {each.lower() for each in members}
    stem, dot, ending = member.rpartition(".")
    number, free = 2, member
    while free.lower() in taken:
        free = f"{stem}_{number}{dot}{ending}"
        number += 1
    return free


def _connection(connections: Element, connection: Connection) -> None:
    attributes = {
        "startElement": connection.source,
        "startConnector": connection.source_variable,
        "endElement": connection.target,
        "endConnector": connection.target_variable,
    }
    if connection.suppress_unit_conversion:
        attributes["suppressUnitConversion"] = "true"
    element = _sub(connections, SSD, "Connection", attributes)
    if (connection.factor, connection.offset) != (1.0, 0.0):
        transformation = {"factor": repr(float(connection.factor)), "offset": repr(float(connection.offset))}
        _sub(element, SSC, "LinearTransformation", transformation)
    _annotate(element, "Connection", {"filter": connection.filter, "extrapolation": connection.extrapolation})


def _parameter_set(component: Component) -> Element:
    """Parameters of a component as an .ssv file."""
    root = ElementTree.Element(
        f"{{{SSV}}}ParameterSet", {"version": "1.0", "name": component.name, "generationTool": _TOOL}
    )
    parameters = _sub(root, SSV, "Parameters")
    for name, value in component.parameters.items():
        variable = component.instance.variables.get(name)
        parameter = _sub(parameters, SSV, "Parameter", {"name": name})
        if isinstance(value, bool | np.bool_):
            _sub(parameter, SSV, "Boolean", {"value": str(bool(value)).lower()})
        elif isinstance(value, str):
            _sub(parameter, SSV, "String", {"value": value})
        elif isinstance(value, int | np.integer) and (variable is None or variable.type != "Real"):
            _sub(parameter, SSV, "Integer", {"value": str(int(value))})
        elif isinstance(value, int | float | np.integer | np.floating):
            unit = {} if variable is None else _unit_attribute(variable, component.instance.units)
            _sub(parameter, SSV, "Real", {"value": repr(float(value)), **unit})
        else:
            raise SspError(f"component '{component.name}': parameter '{name}' = {value!r} is of no type of SSP")
    _units(root, [component])
    return root


def _unit_attribute(variable: Variable, units: Mapping[str, Unit]) -> dict[str, str]:
    """The attribute of a unit that can be defined, as the standard asks for."""
    if variable.type != "Real" or not variable.unit or defined(variable.unit, units) is None:
        return {}
    return {"unit": variable.unit}


def _units(root: Element, components: Iterable[Component]) -> None:
    """Definitions of all units that the variables of components name; the first one of a name holds."""
    found: dict[str, Unit] = {}
    for component in components:
        for variable in component.instance.variables.values():
            unit = defined(variable.unit, component.instance.units) if variable.unit else None
            if unit is not None and variable.unit and variable.type == "Real":
                found.setdefault(variable.unit, unit)
    if not found:
        return
    group = _sub(root, SSV if root.tag.startswith(f"{{{SSV}}}") else SSD, "Units")
    for name, unit in found.items():
        base = {key: str(power) for key, power in zip(BASE_UNITS, unit.exponents, strict=True) if power}
        if unit.factor != 1.0:
            base["factor"] = repr(unit.factor)
        if unit.offset != 0.0:
            base["offset"] = repr(unit.offset)
        _sub(_sub(group, SSC, "Unit", {"name": name}), SSC, "BaseUnit", base)
