"""Numbers, units, times and names as the report writes them."""

from __future__ import annotations

import math
import re

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.scenarios.statistics.records import Estimate
from tlpsim.scenarios.statistics.summary import TABLE_UNITS, conversion

UNKNOWN = "–"
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_SQUARED = {"1e-4 rad": "(10⁻⁴ rad)²", "1e-2 rad": "(10⁻² rad)²"}
_PREFIXED = {"N": "force", "N.m": "moment"}
_MOTION = re.compile(r"(.+)\.position\.(\w+)")


def number(value: float, digits: int = 3) -> str:
    """A number with so many decimals; a dash for what is not known, and no minus before zeros."""
    if not math.isfinite(value):
        return UNKNOWN
    text = f"{value:.{digits}f}"
    return (text.replace("-", "", 1) if float(text) == 0.0 else text).replace("-", "−")


def short(value: float, figures: int = 3) -> str:
    """A number with so many significant figures, without an exponent where it is not far from one."""
    if not math.isfinite(value):
        return UNKNOWN
    if value == 0.0:
        return "0"
    mantissa, _, exponent = f"{value:.{figures - 1}e}".partition("e")
    power = int(exponent)
    if power < -5 or power > 7:
        return f"{mantissa}·10{str(power).translate(_SUPERSCRIPT)}".replace("-", "−")
    decimals = figures - 1 - power
    return f"{round(value, decimals):,.{max(decimals, 0)}f}".replace(",", "\u202f").replace("-", "−")


def interval(estimate: Estimate, factor: float = 1.0, digits: int = 3) -> str:
    """The interval of an estimate times a factor, "" where it is not known."""
    low, high = factor * estimate.low, factor * estimate.high
    if not (math.isfinite(low) and math.isfinite(high)):
        return ""
    return f"{number(low, digits)} to {number(high, digits)}"


def typeset(unit: str) -> str:
    """A unit as it is printed: m/s², kN·m, 10⁻⁴ rad; "" for none."""
    unit = re.sub(r"1e(-?\d+)", lambda found: f"10{found[1].translate(_SUPERSCRIPT)}", unit)
    unit = re.sub(r"(?<=[a-zA-Z])(-?\d)", lambda found: found[1].translate(_SUPERSCRIPT), unit)
    return unit.replace(".", "·").replace("**", "")


def squared(unit: str) -> str:
    """The square of a unit as it is printed: m², (10⁻⁴ rad)²."""
    plain = typeset(unit)
    return _SQUARED.get(unit, f"{plain}²" if re.fullmatch(r"\w+", plain) else f"({plain})²")


def seconds(time: float) -> str:
    """A length of time: 45 s, 10 min, 3 h, 2 h 46 min 40 s."""
    if not math.isfinite(time):
        return UNKNOWN
    if time < 120.0:
        return f"{short(time)} s"
    whole = round(time)
    parts = ((whole // 3600, "h"), (whole // 60 % 60, "min"), (whole % 60, "s"))
    return " ".join(f"{count} {name}" for count, name in parts if count)


def display_unit(name: str, unit: str, values: NDArray[np.float64]) -> tuple[str, float]:
    """Unit in which a signal is shown, and how many of it there are in the recorded unit.

    Motions are shown as in Table I, forces and moments in k or M where they are large.
    """
    motion = _MOTION.fullmatch(name)
    if motion and motion[2] in DEGREES_OF_FREEDOM:
        wanted, factor = TABLE_UNITS[motion[2]]
        base = "rad" if wanted.endswith("rad") else "m"
        if unit == base or conversion(unit, base) != 1.0:
            return wanted, factor * conversion(unit, base)
    if unit in _PREFIXED and len(values):
        largest = float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))
        for prefix, size in (("M", 1e6), ("k", 1e3)):
            if largest >= 0.1 * size:
                return f"{prefix}{unit}", 1.0 / size
    return unit, 1.0


def listed(names: list[str]) -> str:
    """Names as a list in a sentence: a, b and c."""
    return " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else "".join(names)


def rounded(values: NDArray[np.float64], figures: int = 4) -> list[float | None]:
    """Values to so many significant figures, as short JSON; None for what is not finite."""
    return [float(f"{value:.{figures}g}") if math.isfinite(value) else None for value in values.tolist()]
