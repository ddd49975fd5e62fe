"""One-step solvers of ordinary differential equations for model-exchange FMUs, and the location of events.

Only one-step methods: inputs jump at communication points, so that a solver starts anew there, where a multistep method
falls back to its lowest order; and a solver without a past is rolled back by its step size alone.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import SolverError, WiringError

FloatArray = NDArray[np.float64]

METHODS = ("RK45", "DOP853", "Radau")
INPUTS = ("linear", "hold")

_SMALLEST_TOLERANCE = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class SolverOptions:
    """How the differential equations of a component are solved.

    Parameters
    ----------
    method
        ``RK45`` (Dormand and Prince, order 5), ``DOP853`` (order 8, for tight tolerances) or ``Radau`` (implicit, order
        5, for stiff equations), as SciPy has them.
    relative_tolerance
        Of the error of a solver's step, by state.
    absolute_tolerance
        The same in nominal values of the states, which the FMU declares; None for the relative one.
    longest_step
        Longest step of the solver in s, so that no event passes unseen within one; None for the communication step.
    inputs
        ``linear`` takes the inputs for those of the end of the communication step, and brings continuous ones there
        from their last values; ``hold`` takes them for those of the whole step.

    Raises
    ------
    WiringError
        If a value is out of range.
    """

    method: str = "RK45"
    relative_tolerance: float = 1e-6
    absolute_tolerance: float | None = None
    longest_step: float | None = None
    inputs: str = "linear"

    def __post_init__(self) -> None:
        for name, known in (("method", METHODS), ("inputs", INPUTS)):
            if getattr(self, name) not in known:
                raise WiringError(f"solver option {name} = '{getattr(self, name)}' is not one of {', '.join(known)}")
        limits = {
            "relative_tolerance": (_SMALLEST_TOLERANCE, 0.1),
            "absolute_tolerance": (0.0, math.inf),
            "longest_step": (0.0, math.inf),
        }
        for name, (lower, upper) in limits.items():
            value = getattr(self, name)
            if value is not None and not lower < value < upper:
                raise WiringError(f"solver option {name} = {value} is not between {lower:g} and {upper:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class OdeStep:
    """A step of a solver.

    Parameters
    ----------
    before, after
        Its start and end in s.
    states
        At the end, shape (number of states,).
    interpolant
        Function that makes a function of a time in s within the step that gives the states; until the next step.
    next_size
        Size in s that the solver would take next.
    """

    before: float
    after: float
    states: FloatArray
    interpolant: Callable[[], Callable[[float], FloatArray]]
    next_size: float | None


def ode_steps(
    derivatives: Callable[[float, FloatArray], FloatArray],
    start: float,
    states: FloatArray,
    end: float,
    scale: FloatArray,
    options: SolverOptions,
    first_size: float | None = None,
) -> Iterator[OdeStep]:
    """Integrate from `start` to `end`, both in s, one step of the solver at a time.

    Parameters
    ----------
    derivatives
        Function of time in s and states, shape (number of states,); not a number where it cannot be had, so that the
        solver tries a smaller step.
    states
        At the start. Without any, there is one step.
    scale
        Absolute tolerance of each state.
    first_size
        Size of the first step in s; None to choose one.

    Raises
    ------
    SolverError
        If a derivative at the start is not finite, or no step is small enough for the tolerances.
    """
    if not states.size:
        yield OdeStep(before=start, after=end, states=states, interpolant=lambda: lambda time: states, next_size=None)
        return
    if not np.isfinite(derivatives(start, states)).all():
        raise SolverError("a derivative is not a finite number")
    longest = min(options.longest_step or math.inf, end - start)
    first = None if first_size is None else min(first_size, longest)
    import scipy.integrate  # here, because few systems need it and it takes long to load

    solver = getattr(scipy.integrate, options.method)(
        derivatives,
        start,
        states,
        end,
        max_step=longest,
        rtol=options.relative_tolerance,
        atol=scale,
        first_step=first,
    )
    while solver.status == "running":
        planned = solver.h_abs
        try:
            message = solver.step()
        except (ValueError, np.linalg.LinAlgError) as error:
            raise SolverError(str(error)) from error
        if solver.status == "failed":
            raise SolverError(f"{message}")
        # a step cut short by the end says nothing of the size that would do
        cut = solver.status == "finished" and solver.t - solver.t_old < planned
        yield OdeStep(
            before=solver.t_old,
            after=solver.t,
            states=solver.y,
            interpolant=solver.dense_output,
            next_size=max(solver.h_abs, planned) if cut else solver.h_abs,
        )


def first_time(changed: Callable[[float], bool], before: float, after: float) -> float:
    """Earliest time from which on a condition holds that does not before, and does `after`; by bisection."""
    while True:
        middle = 0.5 * (before + after)
        if not before < middle < after:
            return after
        if changed(middle):
            after = middle
        else:
            before = middle
