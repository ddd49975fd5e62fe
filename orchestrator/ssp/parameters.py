"""Parameters of the standard SSP: sets of values (.ssv), mappings of their names (.ssm), and their units."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from tlpsim.orchestrator.archive import Element
from tlpsim.orchestrator.instance import Instance, Unit, nearest_match
from tlpsim.orchestrator.ssp.annotations import (
    SspError,
    attribute,
    boolean,
    child,
    children,
    flag,
    linear_transformation,
    local_name,
    number,
)
from tlpsim.orchestrator.units import BASE_UNITS, unit_conversion

Load = Callable[[Element, str], Element]
"""Root of the file that the attribute ``source`` of an element names; the text says where, for messages."""

Place = tuple[str, ...]
"""Where an element is: the names of the systems around it, but for the outermost one, and its own."""
Port = tuple[Place, str]
"""A connector: where its element is, and its name."""

_SET, _MAPPING = "application/x-ssp-parameter-set", "application/x-ssp-parameter-mapping"
_REALS = ("Real", "Float64", "Float32")
_INTEGERS = ("Integer", *(f"{sign}Int{width}" for sign in ("", "U") for width in (8, 16, 32, 64)))
_SCALAR = float | int | bool | str


@dataclass(frozen=True, slots=True, kw_only=True)
class Value:
    """A value on its way to a parameter.

    Parameters
    ----------
    value
        Number, truth value or text; a list for an array.
    unit, units
        Name of its unit, and the definitions of units around it.
    transformations
        Factors and offsets that it goes through after the conversion of units, the first one first.
    suppress_unit_conversion
        Take the number as it is.
    where
        Where it comes from, for messages.
    """

    value: _SCALAR | list[_SCALAR]
    unit: str | None
    units: Mapping[str, Unit]
    where: str
    transformations: tuple[tuple[float, float], ...] = ()
    suppress_unit_conversion: bool = False

    def transformed(self, factor: float, offset: float, suppress_unit_conversion: bool) -> Value:
        """The value after one more linear transformation."""
        more = () if (factor, offset) == (1.0, 0.0) else ((factor, offset),)
        return replace(
            self,
            transformations=self.transformations + more,
            suppress_unit_conversion=self.suppress_unit_conversion or suppress_unit_conversion,
        )

    def applied(self, instance: Instance, name: str, unit: str | None) -> object:
        """The value in the unit of a variable of an instance.

        Raises
        ------
        SspError
            If the units are of different dimensions, or a value that is no number is to be transformed.
        """
        gain, offset = 1.0, 0.0
        if self.unit and not self.suppress_unit_conversion:
            try:
                gain, offset = unit_conversion(self.unit, unit, self.units, instance.units)
            except ValueError as error:
                raise SspError(
                    f"{self.where}: '{instance.name}.{name}' takes {unit}: {error}; correct the unit"
                ) from None
        if (gain, offset) == (1.0, 0.0) and not self.transformations:
            return self.value
        values = self.value if isinstance(self.value, list) else [self.value]
        result: list[float] = []
        for value in values:
            if isinstance(value, bool | str):
                raise SspError(f"{self.where}: the value {value!r} is no number and cannot be transformed")
            value = gain * value + offset
            for factor, constant in self.transformations:
                value = factor * value + constant
            result.append(value)
        return result if isinstance(self.value, list) else result[0]


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """A connection as written: where it comes from, and what happens on it."""

    start: Port
    factor: float
    offset: float
    suppress_unit_conversion: bool
    settings: dict[str, Any]
    where: str


def read_units(root: Element, where: str) -> dict[str, Unit]:
    """Definitions in the element ``Units`` of a file, by name."""
    units = {}
    for element in children(root, "Units", "Unit"):
        name = attribute(element, "name", where)
        base = child(element, "BaseUnit")
        if base is None:
            continue
        try:
            kg, m, s, ampere, kelvin, mol, cd, rad = (int(base.get(key, "0")) for key in BASE_UNITS)
            factor, offset = float(base.get("factor", "1")), float(base.get("offset", "0"))
        except ValueError as error:
            raise SspError(f"{where}: the unit '{name}' is malformed: {error}") from None
        if not factor:
            raise SspError(f"{where}: the unit '{name}' has the factor 0; give its size in base units")
        units[name] = Unit(exponents=(kg, m, s, ampere, kelvin, mol, cd, rad), factor=factor, offset=offset)
    return units


def read_bindings(element: Element, where: str, load: Load) -> list[tuple[str, Value]]:
    """Values of all parameter bindings of a component or system, with the names that they are for.

    Parameters
    ----------
    element
        Component or system.
    where
        Its name, for messages.
    load
        Reads the files that bindings name.

    Returns
    -------
    Names and values in the order of the file; later ones go over earlier ones.

    Raises
    ------
    SspError
        If a binding, a set of values or a mapping is malformed or of a kind that is not supported.
    """
    result: list[tuple[str, Value]] = []
    for binding in children(element, "ParameterBindings", "ParameterBinding"):
        parameters = _content(binding, "ParameterValues", "ParameterSet", _SET, where, load)
        prefix = binding.get("prefix", "")
        values = {prefix + name: value for name, value in _read_set(parameters, where).items()}
        mapping = child(binding, "ParameterMapping")
        if mapping is None:
            result += values.items()
            continue
        entries = _content(mapping, "", "ParameterMapping", _MAPPING, where, load)
        result += _mapped(values, entries, f"{where}, mapping of parameters")
    return result


def _content(element: Element, inside: str, name: str, kind: str, where: str, load: Load) -> Element:
    """The set or mapping that an element names by its source, or holds."""
    if element.get("type", kind) != kind:
        raise SspError(f"{where}: <{local_name(element)}> is of the type '{element.get('type')}'; only {kind} is read")
    if element.get("sourceBase", "SSD") != "SSD":
        raise SspError(
            f"{where}: <{local_name(element)}> has sourceBase = '{element.get('sourceBase')}'; put the file beside the "
            "description and leave sourceBase out"
        )
    if element.get("source"):
        root = load(element, where)
        if local_name(root) != name:
            raise SspError(f"{where}: '{element.get('source')}' holds <{local_name(root)}>, not <{name}>")
        return root
    found = child(element, *([inside] if inside else []), name)
    if found is None:
        raise SspError(f"{where}: <{local_name(element)}> has neither a source nor a <{name}>; give one")
    return found


def _read_set(root: Element, where: str) -> dict[str, Value]:
    units = read_units(root, where)
    values = {}
    for parameter in children(root, "Parameters", "Parameter"):
        name = attribute(parameter, "name", where)
        here = f"{where}, parameter '{name}'"
        typed = next((item for item in parameter if item.get("value") is not None), None)
        if typed is None:
            raise SspError(f"{here}: it has no value; give one, such as <Real value='1'/>")
        values[name] = Value(value=_value(typed, root, here), unit=typed.get("unit"), units=units, where=here)
    return values


def _value(element: Element, root: Element, where: str) -> _SCALAR | list[_SCALAR]:
    kind, text = local_name(element), element.get("value", "")
    if kind == "String":
        return text
    readers: dict[str, Callable[[str], _SCALAR]] = {
        **dict.fromkeys(_REALS, float),
        **dict.fromkeys(_INTEGERS, int),
        "Boolean": lambda word: boolean(word, f"{where}: the value"),
        "Enumeration": lambda word: _item(root, element.get("name"), word, where),
    }
    if kind not in readers:
        raise SspError(f"{where}: values of the type {kind} are not supported; give a number, truth value or text")
    try:
        values = [readers[kind](word) for word in ([text] if kind == "Enumeration" else text.split())]
    except ValueError:
        raise SspError(f"{where}: '{text}' is not of the type {kind}") from None
    if not values:
        raise SspError(f"{where}: the value is empty; give one of the type {kind}")
    return values[0] if len(values) == 1 else values


def _item(root: Element, enumeration: str | None, word: str, where: str) -> int:
    """Number of an item of an enumeration of the same file."""
    for table in children(root, "Enumerations", "Enumeration"):
        if enumeration in (None, table.get("name")):
            for item in children(table, "Item"):
                if item.get("name") == word:
                    value = number(item, "value", where)
                    if value is not None:
                        return int(value)
    raise SspError(f"{where}: no enumeration of the file has an item '{word}'; define it, or give an Integer")


def _mapped(values: Mapping[str, Value], root: Element, where: str) -> list[tuple[str, Value]]:
    result = []
    for entry in children(root, "MappingEntry"):
        source, target = attribute(entry, "source", where), attribute(entry, "target", where)
        if source not in values:
            raise SspError(f"{where}: no parameter '{source}' to map to '{target}'; the set has {', '.join(values)}")
        factor, offset = linear_transformation(entry, where)
        suppressed = flag(entry, "suppressUnitConversion", where)
        result.append((target, values[source].transformed(factor, offset, suppressed)))
    return result


def parametrized(
    instances: Mapping[Place, Instance],
    connectors: Mapping[Place, Mapping[str, str]],
    values: Sequence[tuple[Place, str, Value]],
    open_ends: Mapping[Port, Sequence[Leg]],
) -> tuple[dict[Place, dict[str, object]], list[str]]:
    """Parameters of each component.

    Parameters
    ----------
    instances, connectors
        Components, and connectors of systems with their kinds, by place.
    values
        Places of the components and systems that have a binding, and what it binds, in the order of the file.
    open_ends
        Inputs and parameters that connectors of systems feed, with the legs that lead to them, the first one first.

    Returns
    -------
    Parameters by place of the component, and notes on values that are for nothing.
    """
    notes = []
    of_systems: dict[Port, Value] = {}
    parameters: dict[Place, dict[str, object]] = {path: {} for path in instances}
    for level, name, value in sorted(values, key=lambda each: -len(each[0])):
        targets = 0
        for path, instance in instances.items():
            own = _below(path, level, name)
            if own in instance.variables or own in instance.arrays:
                parameters[path][own] = _applied(instance, own, value)
                targets += 1
        for path, kinds in connectors.items():
            own = _below(path, level, name)
            if own in kinds:
                of_systems[path, own] = value
                targets += 1
        if not targets:
            near = nearest_match(name, instances[level].variables) if level in instances else ""
            notes.append(f"{value.where}: '{name}' is the name of no variable{near}; the value is not used")
    for (path, name), legs in open_ends.items():
        for first, leg in enumerate(legs):
            given = of_systems.get(leg.start)
            if given is not None:
                for each in legs[first:]:
                    given = given.transformed(each.factor, each.offset, each.suppress_unit_conversion)
                parameters[path][name] = _applied(instances[path], name, given)
                break
    return parameters, notes


def _below(path: Place, level: Place, name: str) -> str:
    """Name, in the element at `path`, of what is called `name` at `level`; "" if it is not in there."""
    if path[: len(level)] != level:
        return ""
    prefix = "".join(f"{part}." for part in path[len(level) :])
    return name[len(prefix) :] if name.startswith(prefix) else ""


def _applied(instance: Instance, name: str, value: Value) -> object:
    variable = instance.variables.get(name) or next(
        (each for key, each in instance.variables.items() if key.startswith(f"{name}[")), None
    )
    return value.applied(instance, name, None if variable is None else variable.unit)
