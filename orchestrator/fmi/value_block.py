"""Values of one numeric type that an FMU takes or gives in one call, and how they come from and go to float64."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import StepError
from tlpsim.orchestrator.fmi.model_variables import Place

FloatArray = NDArray[np.float64]


class ValueBlock:
    """Buffers of one call of a set or get function of FMI.

    Parameters
    ----------
    function, name
        The function and its name.
    type
        Type of a value.
    names
        Names of all bound variables.
    bound
        Positions in `names` of those of this type, shape (number of bound ones,).
    locations
        Where the variables are, by name.

    Attributes
    ----------
    references
        Value references, shape (number of references,). An array is passed whole, a variable of two names once.
    values
        Values of all of their elements, shape (number of values,).
    places
        Places in `values` of the bound variables, shape (number of bound ones,).
    arguments
        Arguments of the function, set by who owns the block.
    """

    __slots__ = (
        "_boolean",
        "_bound",
        "_first",
        "_limits",
        "_names",
        "_whole",
        "arguments",
        "function",
        "name",
        "places",
        "references",
        "type",
        "values",
    )

    def __init__(
        self,
        function: Any,
        name: str,
        type: type[np.generic],
        names: Sequence[str],
        bound: Sequence[int],
        locations: Mapping[str, Place],
    ) -> None:
        self.function: Callable[..., int] = function
        self.name = name
        self.type = type
        self.arguments: tuple[Any, ...] = ()
        self._names = [names[position] for position in bound]
        self._first: dict[int, tuple[int, Place]] = {}  # by reference: where its values begin
        count = 0
        for place in (locations[own] for own in self._names):
            if place.reference not in self._first:
                self._first[place.reference] = (count, place)
                count += place.size
        self.references = np.array(list(self._first), dtype=np.uint32)
        self.values = np.zeros(count, dtype=type)
        self.places = np.array(
            [self._first[place.reference][0] + place.position for place in (locations[own] for own in self._names)],
            dtype=np.int64,
        )
        self._bound = np.array(bound, dtype=np.int64)
        everything = np.arange(count)
        self._whole = len(bound) == len(names) and np.array_equal(self.places, everything)
        self._boolean = name.endswith("Boolean")
        # the upper one, exclusive, is a power of two and so exact
        self._limits: tuple[float, float] | None = None
        if issubclass(type, np.integer) and not self._boolean:
            self._limits = float(np.iinfo(type).min), float(int(np.iinfo(type).max) + 1)

    def fill(self, starts: Callable[[Place], Sequence[Any]]) -> None:
        """Fill the buffer with the start values of the variables that it holds."""
        for first, place in self._first.values():
            self.values[first : first + place.size] = starts(place)

    def take(self, given: FloatArray, component: str) -> None:
        """Copy the values of this block from those of all bound variables.

        Raises
        ------
        StepError
            If a value is out of the range of an integer; the message names the component.
        """
        if self._whole and self.type is np.float64:
            self.values[:] = given
            return
        own = given[self._bound]
        if self._boolean:
            self.values[self.places] = own >= 0.5
            return
        if self._limits is not None:
            own = np.rint(own)
            lower, upper = self._limits
            within = (own >= lower) & (own < upper)
            if not within.all():
                first = int(np.argmin(within))
                raise StepError(
                    f"{component}: input '{self._names[first]}' = {given[self._bound[first]]:g} is not within "
                    f"{lower:.0f} … {int(upper) - 1}, the range of {self.name}"
                )
        self.values[self.places] = own

    def give(self, into: FloatArray) -> None:
        """Copy the values of this block to those of all bound variables."""
        if self._whole:
            into[:] = self.values
        else:
            into[self._bound] = self.values[self.places]
