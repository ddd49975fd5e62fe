"""Variables, units and structure of an FMU, from the model description of FMI 2.0 or 3.0.

An array is taken apart into scalar variables ``x[1]``, ``x[2]`` or ``x[1,1]``, ``x[1,2]``, last index fastest. Binary
variables, clocks and what ticks with a clock are left out: a component of a system has none of them.
"""

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from tlpsim.loads.errors import FmuError
from tlpsim.orchestrator.archive import Element
from tlpsim.orchestrator.instance import Unit, Variable

LARGEST_COUNT = 1_000_000
"""Scalar variables that an FMU may have; each takes about half a kilobyte."""

_FMI2_TYPES = {"Real": "Real", "Integer": "Integer", "Enumeration": "Integer", "Boolean": "Boolean", "String": "String"}
_FMI3_TYPES = {
    **{name: name for name in ("Float32", "Float64", "Boolean", "String")},
    **{f"{sign}Int{bits}": f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)},
    "Enumeration": "Int64",
}
_BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_LARGEST_REFERENCE = 2**32 - 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where the functions of FMI find a scalar variable.

    Parameters
    ----------
    variable
        Name of the declared variable, an array's for an element of it.
    type
        Type in the names of the get and set functions: ``Real``, ``Float64``, ``Int32``, …
    reference
        Value reference.
    position, size
        Number of the element, from 0, and number of elements; 0 and 1 for a scalar.
    """

    variable: str
    type: str
    reference: int
    position: int = 0
    size: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelVariables:
    """Variables of an FMU.

    Parameters
    ----------
    variables
        Scalar variables by name, in the order of declaration.
    places
        Where they are, by the same names.
    arrays
        Shapes of arrays by name.
    state_derivatives
        Names of the derivatives of the continuous states, in the order of the states; empty where not declared.
    event_indicators
        Number of event indicators.
    """

    variables: Mapping[str, Variable]
    places: Mapping[str, Place]
    arrays: Mapping[str, tuple[int, ...]]
    state_derivatives: tuple[str, ...]
    event_indicators: int


def element_names(name: str, shape: Sequence[int]) -> tuple[str, ...]:
    """Names of the elements of an array of this shape, last index fastest; of a scalar its own."""
    if not shape:
        return (name,)
    indices = itertools.product(*(range(1, count + 1) for count in shape))
    return tuple(f"{name}[{','.join(map(str, index))}]" for index in indices)


@dataclass(slots=True, kw_only=True)
class _Declared:
    """A variable as it is declared; `element` bears the attributes that depend on the type."""

    name: str
    type: str
    element: Element
    common: Element
    reference: int
    aliases: tuple[str, ...] = ()
    shape: tuple[int, ...] = field(default=())

    @property
    def names(self) -> tuple[str, ...]:
        return element_names(self.name, self.shape)


Lookup = Callable[[str], _Declared | None]
"""The variable that an index (FMI 2.0) or a value reference (FMI 3.0) stands for; None for one that is left out."""


def _boolean(text: str) -> bool:
    return {"true": True, "1": True, "false": False, "0": False}[text.strip()]


def _whole(text: str) -> int:
    value = int(text)
    if not 0 <= value <= _LARGEST_REFERENCE:
        raise ValueError
    return value


def _malformed(where: str, attribute: str, text: str | None) -> FmuError:
    said = f"no {attribute}" if text is None else f"the malformed {attribute} '{text}'"
    return FmuError(f"{where} has {said}; correct modelDescription.xml or export the FMU again")


def read_attribute(element: Element, attribute: str, convert: Callable[[str], Any], where: str, default: Any) -> Any:
    """Convert an attribute.

    Parameters
    ----------
    convert
        Function that raises ValueError, KeyError or OverflowError for a malformed text.
    where
        What has the attribute, for the error message.
    default
        Value where it is absent; FmuError if that is None.

    Raises
    ------
    FmuError
        If the attribute is malformed, or is absent and has no default.
    """
    text = element.get(attribute)
    if text is None:
        if default is None:
            raise _malformed(where, attribute, None)
        return default
    try:
        return convert(text)
    except (ValueError, KeyError, OverflowError):
        raise _malformed(where, attribute, text) from None


_CONVERTERS: dict[str, Callable[[str], float | int | bool | str]] = {
    "Real": float,
    "Integer": int,
    "Boolean": _boolean,
    "String": str,
}


def plain_type(type: str) -> str:
    """Type of a variable for the master, of the type that it has in FMI."""
    if type in ("Boolean", "String"):
        return type
    return "Real" if type.startswith(("Real", "Float")) else "Integer"


def read_units(root: Element, where: str) -> dict[str, Unit]:
    """Definitions of units by name.

    Raises
    ------
    FmuError
        If an exponent, a factor or an offset is malformed, or a factor is 0.
    """
    units: dict[str, Unit] = {}
    for unit in root.iterfind("UnitDefinitions/Unit"):
        base = unit.find("BaseUnit")
        if base is None:
            continue
        name = unit.get("name", "")
        of = f"{where}: unit '{name}'"
        kg, m, s, a, k, mol, cd, rad = (read_attribute(base, symbol, int, of, 0) for symbol in _BASE_UNITS)
        factor = read_attribute(base, "factor", float, of, 1.0)
        if not factor:
            raise FmuError(f"{of} has the factor 0; its size in base units is needed")
        offset = read_attribute(base, "offset", float, of, 0.0)
        units[name] = Unit(exponents=(kg, m, s, a, k, mol, cd, rad), factor=factor, offset=offset)
    return units


def _declared_units(root: Element) -> dict[str, str]:
    """Units of declared types: of FMI 2.0 in a child of SimpleType, of FMI 3.0 in FloatXXType itself."""
    simple = {
        item.get("name", ""): child.get("unit", "")
        for item in root.iterfind("TypeDefinitions/SimpleType")
        for child in item
    }
    return simple | {item.get("name", ""): item.get("unit", "") for item in root.iterfind("TypeDefinitions/*[@unit]")}


def _declarations(root: Element, where: str, version: int) -> list[_Declared | None]:
    """Variables in the order of declaration; None for those that are left out."""
    result: list[_Declared | None] = []
    types = _FMI2_TYPES if version == 2 else _FMI3_TYPES
    for number, element in enumerate(root.iterfind("ModelVariables/*"), 1):
        candidates: Iterable[Element] = element if version == 2 else (element,)
        typed = next((item for item in candidates if item.tag in types), None)
        if typed is None or element.get("clocks") is not None:
            result.append(None)
            continue
        name = read_attribute(element, "name", str, f"{where}: variable number {number}", None)
        result.append(
            _Declared(
                name=name,
                type=types[typed.tag],
                element=typed,
                common=element,
                reference=read_attribute(element, "valueReference", _whole, f"{where}: variable '{name}'", None),
                aliases=tuple(alias.get("name", "") for alias in element.iterfind("Alias")),
            )
        )
    return result


def _lookup(declared: Sequence[_Declared | None], version: int) -> Lookup:
    if version == 2:

        def by_index(text: str) -> _Declared | None:
            return declared[range(1, len(declared) + 1).index(int(text))]

        return by_index
    references = {item.reference: item for item in declared if item is not None}
    return lambda text: references.get(_whole(text))


def _set_shapes(declared: Iterable[_Declared], lookup: Lookup, where: str) -> None:
    """Find the sizes of arrays: as given, or the start value of a structural parameter."""

    def size(dimension: Element, of: str) -> int:
        if dimension.get("start") is not None:
            return int(read_attribute(dimension, "start", _whole, f"{of}: Dimension", None))
        parameter = read_attribute(dimension, "valueReference", lookup, f"{of}: Dimension", None)
        if parameter is None:
            raise _malformed(f"{of}: Dimension", "valueReference", dimension.get("valueReference"))
        return int(read_attribute(parameter.element, "start", _whole, f"{where}: variable '{parameter.name}'", None))

    count = 0
    for item in declared:
        of = f"{where}: variable '{item.name}'"
        item.shape = tuple(size(dimension, of) for dimension in item.element.iterfind("Dimension"))
        count += math.prod(item.shape) * (1 + len(item.aliases))
        if count > LARGEST_COUNT:
            raise FmuError(f"{of}, with those before it, has {count} elements; an FMU may have {LARGEST_COUNT}")


def _starts(item: _Declared, of: str) -> list[Any]:
    """Start values of the elements; one value stands for all of them."""
    count = math.prod(item.shape)
    convert = _CONVERTERS[plain_type(item.type)]
    texts: list[str] | None = None
    text = item.element.get("start")
    if text is not None:
        texts = text.split() if item.shape else [text]
    elif item.element.find("Start") is not None:  # strings of FMI 3.0
        texts = [start.get("value", "") for start in item.element.iterfind("Start")]
    if texts is None:
        return [None] * count
    if len(texts) == 1:
        texts = texts * count
    if len(texts) != count:
        raise FmuError(f"{of} has {len(texts)} start values for {count} elements; give one or as many as elements")
    try:
        return [convert(text) for text in texts]
    except (ValueError, KeyError):
        raise _malformed(of, "start", text) from None


def _dependencies(root: Element, lookup: Lookup, where: str, version: int) -> dict[str, tuple[str, ...]]:
    """Names of the inputs on which each declared output depends directly, where that is declared."""
    path, key = ("Outputs/Unknown", "index") if version == 2 else ("Output", "valueReference")
    result: dict[str, tuple[str, ...]] = {}
    for unknown in root.iterfind(f"ModelStructure/{path}"):
        output = _known(unknown, key, lookup, f"{where}: ModelStructure")
        if output is None or unknown.get("dependencies") is None:
            continue
        sources = read_attribute(
            unknown,
            "dependencies",
            lambda text: [lookup(part) for part in text.split()],
            f"{where}: variable '{output.name}'",
            None,
        )
        inputs = [item for item in sources if item is not None and item.common.get("causality") == "input"]
        result[output.name] = tuple(name for item in inputs for name in item.names)
    return result


def _known(element: Element, key: str, lookup: Lookup, where: str) -> _Declared | None:
    text = element.get(key)
    try:
        return None if text is None else lookup(text)
    except (ValueError, OverflowError):
        raise _malformed(where, key, text) from None


def _derivatives(declared: Iterable[_Declared], lookup: Lookup, where: str) -> dict[str, tuple[str, ...]]:
    """Names of the elements of which those of each declared variable are the derivatives."""
    result: dict[str, tuple[str, ...]] = {}
    for item in declared:
        state = _known(item.element, "derivative", lookup, f"{where}: variable '{item.name}'")
        if state is not None and state.shape == item.shape:
            result[item.name] = state.names
    return result


def _variability(item: _Declared, causality: str, version: int) -> str:
    stated = item.common.get("variability")
    if stated is not None:
        return stated
    if "arameter" in causality:
        return "fixed"
    return "continuous" if version == 2 or item.type.startswith("Float") else "discrete"


def _structure(root: Element, path: str, key: str, lookup: Lookup, where: str) -> Iterator[_Declared]:
    for element in root.iterfind(path):
        item = _known(element, key, lookup, f"{where}: ModelStructure")
        if item is not None:
            yield item


def read_variables(root: Element, where: str, version: int) -> ModelVariables:
    """Read the variables of a model description.

    Parameters
    ----------
    root
        The element fmiModelDescription.
    where
        Path of the FMU, for error messages.
    version
        Of FMI: 2 or 3.

    Raises
    ------
    FmuError
        If an attribute is malformed, a name is used twice, or there are more than `LARGEST_COUNT` scalar variables.
    """
    positions = _declarations(root, where, version)
    lookup = _lookup(positions, version)
    declared = [item for item in positions if item is not None]
    _set_shapes(declared, lookup, where)
    units = _declared_units(root)
    dependencies = _dependencies(root, lookup, where, version)
    derivatives = _derivatives(declared, lookup, where)
    variables: dict[str, Variable] = {}
    places: dict[str, Place] = {}
    arrays: dict[str, tuple[int, ...]] = {}
    for item in declared:
        causality = item.common.get("causality", "local")
        starts = _starts(item, f"{where}: variable '{item.name}'")
        states = derivatives.get(item.name, (None,) * len(starts))
        for own in (item.name, *item.aliases):
            names = element_names(own, item.shape)
            if item.shape:
                arrays[own] = item.shape
            for position, (name, start, state) in enumerate(zip(names, starts, states, strict=True)):
                if name in variables:
                    raise FmuError(f"{where}: variable '{name}' is declared twice; export the FMU again")
                variables[name] = Variable(
                    name=name,
                    causality=causality,
                    variability=_variability(item, causality, version),
                    type=plain_type(item.type),
                    unit=item.element.get("unit") or units.get(item.element.get("declaredType", "")) or None,
                    description=item.common.get("description", ""),
                    start=start,
                    derivative_of=state,
                    depends_on=dependencies.get(item.name),
                )
                places[name] = Place(
                    variable=own, type=item.type, reference=item.reference, position=position, size=len(starts)
                )
    if version == 2:
        states_of = _structure(root, "ModelStructure/Derivatives/Unknown", "index", lookup, where)
        indicators = read_attribute(root, "numberOfEventIndicators", _whole, where, 0)
    else:
        states_of = _structure(root, "ModelStructure/ContinuousStateDerivative", "valueReference", lookup, where)
        of_indicators = _structure(root, "ModelStructure/EventIndicator", "valueReference", lookup, where)
        indicators = sum(math.prod(item.shape) for item in of_indicators)
    return ModelVariables(
        variables=variables,
        places=places,
        arrays=arrays,
        state_derivatives=tuple(name for item in states_of for name in item.names),
        event_indicators=indicators,
    )
