"""Who watches a run: the interface of observers, and one that keeps everything in memory."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tlpsim.orchestrator.clock import NANOSECONDS_PER_SECOND
from tlpsim.orchestrator.system import System, bound_outputs

if TYPE_CHECKING:
    from tlpsim.orchestrator.execution import RunSummary

FloatArray = NDArray[np.float64]


class Observer:
    """Gets told what happens in a run. Does nothing; override what matters."""

    def started(self, system: System) -> None:
        """Prepare for a run of a system whose components have been initialized."""

    def sampled(self, index: int, times: NDArray[np.int64], values: FloatArray) -> None:
        """Take successive samples of one component.

        The samples of one component come in the order of time. Those of different components need not: they come in
        blocks, and a component outside every loop is stepped ahead of those that it feeds, also past the end of the
        run.

        Parameters
        ----------
        index
            Index of the component in the system.
        times
            Times of the samples in ns, shape (samples,).
        values
            The component's bound outputs, see `tlpsim.orchestrator.system.bound_outputs`, shape (samples, outputs).
            Copy what must be kept: the array is used again.
        """

    def stopped(self, reason: BaseException | None, summary: "RunSummary") -> None:
        """Finish; `reason` is what ended the run early, or None. Instances are still allocated.

        Called without `started` before it when the run failed earlier than that.
        """


class MemoryRecorder(Observer):
    """Keeps all samples in memory.

    Attributes
    ----------
    names
        Bound outputs by component name.
    """

    def __init__(self) -> None:
        self.names: dict[str, tuple[str, ...]] = {}
        self._times: list[list[NDArray[np.int64]]] = []
        self._values: list[list[FloatArray]] = []
        self._index: dict[str, int] = {}

    def started(self, system: System) -> None:
        """Forget what was recorded before."""
        outputs = bound_outputs(system)
        self.names = {component.name: names for component, names in zip(system.components, outputs, strict=True)}
        self._index = {component.name: number for number, component in enumerate(system.components)}
        self._times = [[] for _ in system.components]
        self._values = [[] for _ in system.components]

    def sampled(self, index: int, times: NDArray[np.int64], values: FloatArray) -> None:
        """Copy samples."""
        self._times[index].append(times.copy())
        self._values[index].append(values.copy())

    def ticks(self, component: str) -> NDArray[np.int64]:
        """Return the times of a component's samples in ns, shape (samples,)."""
        return np.concatenate([np.zeros(0, dtype=np.int64), *self._times[self._index[component]]])

    def times(self, component: str) -> FloatArray:
        """Return the times of a component's samples in s, shape (samples,)."""
        return self.ticks(component) / NANOSECONDS_PER_SECOND

    def values(self, component: str) -> FloatArray:
        """Return all samples of a component, shape (samples, bound outputs)."""
        width = len(self.names[component])
        return np.concatenate([np.zeros((0, width)), *self._values[self._index[component]]])

    def signal(self, component: str, name: str) -> FloatArray:
        """Return the samples of one output, shape (samples,)."""
        return np.ascontiguousarray(self.values(component)[:, self.names[component].index(name)])
