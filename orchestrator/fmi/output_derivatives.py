"""Time derivatives of outputs that an FMU gives by a function of their own, as if they were variables.

Where an FMU of co-simulation has a maxOutputDerivativeOrder, each of its continuous outputs of 64 bits without a
declared derivative gets the variables ``der(y)`` and, from order 2 on, ``der(der(y))``. They are read by
fmi2GetRealOutputDerivatives or fmi3GetOutputDerivatives, which know nothing before the first step: zero until then.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tlpsim.orchestrator.fmi.model_variables import Place
from tlpsim.orchestrator.instance import Variable

FloatArray = NDArray[np.float64]

_MOST_ORDERS = 2
_WIDE = ("Real", "Float64")


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputDerivative:
    """A time derivative of an output.

    Parameters
    ----------
    variable
        As which it is declared.
    place
        Where the output is.
    order
        1 or 2.
    """

    variable: Variable
    place: Place
    order: int


def output_derivatives(
    variables: Mapping[str, Variable], places: Mapping[str, Place], order: int
) -> dict[str, OutputDerivative]:
    """Derivatives up to an order, by name."""
    declared = {variable.derivative_of for variable in variables.values()}
    result = {}
    for name, variable in variables.items():
        place = places.get(name)
        if place is None or place.type not in _WIDE or name in declared:
            continue
        if variable.causality != "output" or variable.variability != "continuous":
            continue
        base = name
        for each in range(1, min(order, _MOST_ORDERS) + 1):
            own = Variable(
                name=f"der({base})",
                causality="local",
                description=f"time derivative of {base}",
                derivative_of=base,
                depends_on=variable.depends_on,
            )
            result[own.name] = OutputDerivative(variable=own, place=place, order=each)
            base = own.name
    return result


class DerivativeBlock:
    """Buffers of one call of the function for derivatives; the interface of a `ValueBlock` that gives.

    Parameters
    ----------
    function, name
        The function and its name.
    chosen
        The derivatives.
    bound
        Their positions among all bound outputs.
    known
        Function that tells whether a step has been made.
    """

    type = None  # of no value that the compiled loop passes on

    def __init__(
        self,
        function: Callable[..., int],
        name: str,
        chosen: Sequence[OutputDerivative],
        bound: Sequence[int],
        known: Callable[[], bool],
    ) -> None:
        self.function: Callable[..., int] = lambda *arguments: function(*arguments) if known() else 0
        self.name = name
        self.arguments: tuple[Any, ...] = ()
        first: dict[tuple[int, int], int] = {}  # by reference and order: where the values begin, an array whole
        count = 0
        for each in chosen:
            if (each.place.reference, each.order) not in first:
                first[each.place.reference, each.order] = count
                count += each.place.size
        self.references = np.array([reference for reference, _ in first], dtype=np.uint32)
        self.orders = np.array([order for _, order in first], dtype=np.int32)
        self.values = np.zeros(count)
        self._places = np.array([first[each.place.reference, each.order] + each.place.position for each in chosen])
        self._bound = np.array(bound, dtype=np.int64)

    def give(self, into: FloatArray) -> None:
        """Copy the derivatives to their places among all bound outputs."""
        into[self._bound] = self.values[self._places]
