"""Arrays by their elements: from a system with arrays to the scalars that the master steps, in row-major order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tlpsim.loads.errors import WiringError
from tlpsim.loads.filters.interpolation import SYMMETRIC
from tlpsim.orchestrator.fmi.model_variables import element_names

if TYPE_CHECKING:
    from tlpsim.orchestrator.system import System


def expanded(system: System) -> System:
    """Return the system of scalars that a system with arrays stands for.

    Connections, parameters and chosen outputs of arrays are those of their elements. What comes from an Integer or
    Boolean output is held between its samples, whatever the filter: there is nothing in between.

    Raises
    ------
    WiringError
        If the arrays at the two ends of a connection, or an array and its value, differ in shape.
    """
    instances = {component.name: component.instance for component in system.components}
    components = []
    for component in system.components:
        arrays = component.instance.arrays
        if arrays:
            parameters = _expanded_values(component.parameters, arrays, f"component '{component.name}'")
            outputs = component.outputs
            if outputs is not None:
                outputs = tuple(one for name in outputs for one in element_names(name, arrays.get(name, ())))
            component = replace(component, parameters=parameters, outputs=outputs)
        components.append(component)
    connections = []
    for each in system.connections:
        source, target = instances.get(each.source), instances.get(each.target)
        one = () if source is None else source.arrays.get(each.source_variable, ())
        other = () if target is None else target.arrays.get(each.target_variable, ())
        if one != other:
            shapes = [f"an array of shape {shape}" if shape else "a scalar" for shape in (one, other)]
            raise WiringError(
                f"connection {each}: the output is {shapes[0]} and the input {shapes[1]}; "
                "connect arrays of equal shape, or elements"
            )
        names = zip(element_names(each.source_variable, one), element_names(each.target_variable, other), strict=True)
        for output, into in names:
            variable = None if source is None else source.variables.get(output)
            held = variable is not None and variable.type != "Real" and each.filter in SYMMETRIC
            one_by_one = replace(each, source_variable=output, target_variable=into)
            connections.append(replace(one_by_one, filter="hold", extrapolation="hold") if held else one_by_one)
    return replace(system, components=tuple(components), connections=tuple(connections))


def _expanded_values(
    values: Mapping[str, object], arrays: Mapping[str, tuple[int, ...]], where: str
) -> dict[str, object]:
    """Values by name, those of arrays by the names of their elements.

    Parameters
    ----------
    values
        Values by name; of an array nested lists of its shape, or one list of all elements.
    arrays
        Shapes of arrays by name.
    where
        Whose values they are, for the error message.

    Raises
    ------
    WiringError
        If a value has another shape than its array.
    """
    result: dict[str, object] = {}
    for name, value in values.items():
        shape = arrays.get(name)
        if shape is None:
            result[name] = value
            continue
        names = element_names(name, shape)
        try:
            given = np.asarray(value).shape
        except ValueError:
            raise WiringError(f"{where}: '{name}' is given in rows of unequal length; its shape is {shape}") from None
        if given not in (shape, (len(names),)):
            raise WiringError(f"{where}: '{name}' is given with the shape {given}; its shape is {shape}")
        result.update(zip(names, np.asarray(value, dtype=object).ravel().tolist(), strict=True))
    return result
