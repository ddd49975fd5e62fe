"""What reading and writing of the standard SSP (System Structure and Parameterization) share.

An .ssd file is a system: components, connections, parameters. An .ssp file is a zip archive of one, with its FMUs and
parameter files in ``resources/``. What a master needs and the standard has no place for stands in annotations of the
type ``org.tlpsim``:

- ``<Component step="0.1" inputsAt="end"/>`` in a component, the step in s; with ``outputs="chosen"`` the names of the
  outputs to record in ``<Output name="y"/>`` below it
- ``<Connection filter="cubic" extrapolation="derivatives"/>`` in a connection
- ``<Master algorithm="iterative" tolerance="1e-6"/>`` in the description itself: the algorithm of loops, and what
  differs from the defaults of `tlpsim.orchestrator.system.Iteration`
"""

from collections.abc import Iterator
from dataclasses import dataclass

from tlpsim.loads.errors import TlpsimError
from tlpsim.orchestrator.archive import Element
from tlpsim.orchestrator.system import System

SSD = "http://ssp-standard.org/SSP1/SystemStructureDescription"
SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon"
SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
SSM = "http://ssp-standard.org/SSP1/SystemStructureParameterMapping"
OWN = "urn:org.tlpsim:system"
ANNOTATION_TYPE = "org.tlpsim"
DESCRIPTION = "SystemStructure.ssd"
"""Name of the description inside an .ssp file."""
RESOURCES = "resources"


class SspError(TlpsimError):
    """A system description of the standard SSP cannot be read or written."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SystemDescription:
    """A system with what its file says of the run.

    Parameters
    ----------
    name
        Name of the system.
    system
        Components and connections, nested systems resolved: a component of a nested one is ``inner.name``.
    start, stop
        Default start and stop time in s, None where the file has none.
    notes
        What is allowed but may be an oversight.
    """

    name: str
    system: System
    start: float | None = None
    stop: float | None = None
    notes: tuple[str, ...] = ()


def local_name(element: Element) -> str:
    """Name of an element without its namespace."""
    return element.tag.rpartition("}")[2]


def children(element: Element, *path: str) -> Iterator[Element]:
    """Elements at the end of a path of local names."""
    for child in element:
        if local_name(child) == path[0]:
            if len(path) == 1:
                yield child
            else:
                yield from children(child, *path[1:])


def child(element: Element, *path: str) -> Element | None:
    """The first element at the end of a path of local names, or None."""
    return next(children(element, *path), None)


def attribute(element: Element, name: str, where: str) -> str:
    """Value of an attribute that must be there.

    Raises
    ------
    SspError
        If it is missing or empty.
    """
    value = element.get(name)
    if not value:
        raise SspError(f"{where}: <{local_name(element)}> has no attribute '{name}'; add it")
    return value


def number(element: Element, name: str, where: str, default: float | None = None) -> float | None:
    """Value of a numerical attribute, or the default.

    Raises
    ------
    SspError
        If the text is no number.
    """
    text = element.get(name)
    if text is None:
        return default
    try:
        return float(text)
    except ValueError:
        raise SspError(f"{where}: {name} = '{text}' of <{local_name(element)}> is not a number") from None


def flag(element: Element, name: str, where: str) -> bool:
    """Value of a Boolean attribute, False where it is missing.

    Raises
    ------
    SspError
        If the text is not true, false, 1 or 0.
    """
    return boolean(element.get(name, "false"), f"{where}: {name} of <{local_name(element)}>")


def boolean(text: str, what: str) -> bool:
    """Value of the text of a Boolean; SspError where it is none."""
    if text not in ("true", "false", "1", "0"):
        raise SspError(f"{what} = '{text}' is not true or false")
    return text in ("true", "1")


def linear_transformation(element: Element, where: str) -> tuple[float, float]:
    """Factor and offset of a connection or mapping entry, 1 and 0 where it has none.

    Raises
    ------
    SspError
        If they are not numbers, or the transformation is a table of values.
    """
    for other in element:
        if local_name(other).endswith("MappingTransformation"):
            raise SspError(f"{where}: <{local_name(other)}> is not supported; only LinearTransformation is")
    linear = child(element, "LinearTransformation")
    if linear is None:
        return 1.0, 0.0
    factor, offset = number(linear, "factor", where, 1.0), number(linear, "offset", where, 0.0)
    assert factor is not None
    assert offset is not None
    return factor, offset


def own_annotation(element: Element, known: tuple[str, ...], where: str) -> Element | None:
    """The element in an annotation of the type ``org.tlpsim``, or None.

    Raises
    ------
    SspError
        If it has an attribute that is not known.
    """
    for annotation in children(element, "Annotations", "Annotation"):
        if annotation.get("type") == ANNOTATION_TYPE and len(annotation):
            unknown = [name for name in annotation[0].attrib if name not in known]
            if unknown:
                raise SspError(
                    f"{where}: '{unknown[0]}' in the annotation {ANNOTATION_TYPE} is not one of {', '.join(known)}"
                )
            return annotation[0]
    return None
