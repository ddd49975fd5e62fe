"""Do the steps and the duration of a scenario fit together, and if not, what would.

The smallest step must divide every other one, and every step must divide the duration, in whole nanoseconds.
"""

import math
from collections.abc import Mapping, Sequence

from tlpsim.loads.errors import WiringError
from tlpsim.orchestrator.clock import to_positive_ticks, to_seconds
from tlpsim.scenarios.problems import Location, problem


def check_steps(duration: float, steps: Mapping[str, float]) -> None:
    """Check the duration (s) and the step of each component (s, by name).

    Raises
    ------
    PydanticCustomError
        When they do not fit; the text names the nearest values that do.
    """
    end = _ticks(("simulation", "duration"), duration)
    ticks = {name: _ticks(("components", name, "step"), step) for name, step in steps.items()}
    first = min(ticks, key=ticks.__getitem__)
    smallest = ticks[first]
    for name, step in ticks.items():
        if step % smallest:
            text = f"must be a multiple of the smallest step, {_text([smallest])} s of '{first}'"
            remedy = f"give {_text(_around(step, smallest))} s"
            raise problem(("components", name, "step"), steps[name], f"{text}: {remedy}")
    for name, step in ticks.items():
        if end % step:
            text = f"must be a whole number of steps of '{name}', {_text([step])} s"
            remedy = f"give {_text(_around(end, math.lcm(*ticks.values())))} s"
            others = _steps_within(end, step, smallest)
            if others:
                remedy += f", or set components.{name}.step to {_text(others)} s"
            raise problem(("simulation", "duration"), duration, f"{text}: {remedy}")


def _ticks(location: Location, seconds: float) -> int:
    try:
        return to_positive_ticks(seconds, "")
    except WiringError:
        raise problem(location, seconds, "must be a whole number of nanoseconds, at least one") from None


def _around(ticks: int, unit: int) -> list[int]:
    """Positive multiples of the unit next below and above."""
    below = ticks - ticks % unit
    return [multiple for multiple in (below, below + unit) if multiple > 0]


def _steps_within(end: int, step: int, smallest: int) -> list[int]:
    """Steps next below and above `step` that are multiples of the smallest one and divide the duration."""
    if end % smallest:
        return []
    whole, count = end // smallest, step // smallest
    # A divisor is close by as a rule; the search is cut off where a step would be of another order.
    below = next((k for k in range(count - 1, max(count // 100, 1) - 1, -1) if whole % k == 0), 0)
    above = next((k for k in range(count + 1, min(whole, 100 * count) + 1) if whole % k == 0), 0)
    return [k * smallest for k in (below, above) if k]


def _text(ticks: Sequence[int]) -> str:
    return " or ".join(f"{to_seconds(tick):.10g}" for tick in ticks)
