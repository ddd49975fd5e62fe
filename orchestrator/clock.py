"""Time as the master counts it: whole nanoseconds, so that no error accumulates over any number of steps."""

import math

from tlpsim.loads.errors import WiringError

NANOSECONDS_PER_SECOND = 1_000_000_000

LARGEST_TIME = 1 << 62
"""Latest time and earliest one before zero in ns, 146 years: half of what 64 bits hold, so that no sum overflows."""
LARGEST_STEP = 1 << 53
"""Largest step in ns, 104 days."""

# A decimal number of seconds is stored to a relative 1e-16; 1e-3 ns then leaves room for more than ten days.
_TOLERANCE_NANOSECONDS = 1e-3


def to_ticks(seconds: float, what: str) -> int:
    """Convert seconds to whole nanoseconds.

    Parameters
    ----------
    seconds
        Time or duration in s.
    what
        Name of the quantity for the error message, such as ``"step of wind"``.

    Raises
    ------
    WiringError
        If the value is not finite or beyond `LARGEST_TIME`, or not a whole number of nanoseconds within 1e-3 ns (or
        within the rounding of the number itself, where that is larger).
    """
    if not math.isfinite(seconds):
        raise WiringError(f"{what}: {seconds!r} s is not a finite time; give a number of seconds")
    if abs(seconds) > LARGEST_TIME / NANOSECONDS_PER_SECOND:
        raise WiringError(f"{what}: {seconds!r} s is longer than {to_seconds(LARGEST_TIME):.4g} s; give a shorter time")
    nanoseconds = seconds * NANOSECONDS_PER_SECOND
    ticks = round(nanoseconds)
    if abs(nanoseconds - ticks) > max(_TOLERANCE_NANOSECONDS, math.ulp(nanoseconds)):
        raise WiringError(
            f"{what}: {seconds!r} s is not a whole number of nanoseconds; "
            f"give a step such as {to_seconds(max(ticks, 1))!r} s"
        )
    return ticks


def to_positive_ticks(seconds: float, what: str) -> int:
    """Convert seconds to whole nanoseconds and refuse zero and negative values.

    Raises
    ------
    WiringError
        As `to_ticks`, and if the value is not positive.
    """
    ticks = to_ticks(seconds, what)
    if ticks <= 0:
        raise WiringError(f"{what}: {seconds!r} s is not positive; give a positive number of seconds")
    return ticks


def to_seconds(ticks: int) -> float:
    """Convert nanoseconds to the nearest floating-point number of seconds."""
    return ticks / NANOSECONDS_PER_SECOND
