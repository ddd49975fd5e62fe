"""Names and units of what a sweep varies and computes, as its page writes them."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

from tlpsim.scenarios.report.words import UNKNOWN, short, typeset

ANY_TENDON = "tendons"
"""Name of the signal that stands for the tendon which governs: the worst of all tensions at the top."""

HORIZONTAL = ("platform.position.surge", "platform.position.sway")
"""Motions along the two horizontal axes."""

NEGLIGIBLE = 0.02
"""Of the largest in a sweep, of a motion or of that which is like it along the other axis; below it nothing is said"""

_ROTATIONS = ("platform.position.roll", "platform.position.pitch")
ALIKE = {one: other for pair in (HORIZONTAL, _ROTATIONS) for one, other in (pair, pair[::-1])}
"""The same motion along the other horizontal axis."""

_TENDON = re.compile(r"(?:.+\.)?tendon_tension\[(\d+)\]")
_MOTION = re.compile(r"platform\.position\.(\w+)")


@dataclass(frozen=True, slots=True, kw_only=True)
class Statistic:
    """A statistic of a signal.

    Attributes
    ----------
    name, label
        In the table, and on the page.
    unit
        Of its own; "signal" for that of the signal.
    worst
        "max", "min" or "abs": which value an engineer is warned of.
    """

    name: str
    label: str
    unit: str = "signal"
    worst: str = "max"


EXPECTED_EXTREME = "expected_extreme"
"""Of the expected maximum and minimum that which is larger in magnitude, with its sign."""

STATISTICS = (
    Statistic(name=EXPECTED_EXTREME, label="expected extreme ±", worst="abs"),
    Statistic(name="expected_maximum", label="expected maximum"),
    Statistic(name="expected_minimum", label="expected minimum", worst="min"),
    Statistic(name="std", label="standard deviation"),
    Statistic(name="mean", label="mean", worst="abs"),
    Statistic(name="damage_equivalent_range", label="damage-equivalent range"),
    Statistic(name="maximum", label="maximum"),
    Statistic(name="minimum", label="minimum", worst="min"),
    Statistic(name="low_frequency", label="std, low frequency"),
    Statistic(name="wave_frequency", label="std, wave frequency"),
    Statistic(name="zero_crossing_period", label="zero-crossing period", unit="s"),
    Statistic(name="skewness", label="skewness", unit="", worst="abs"),
    Statistic(name="excess_kurtosis", label="excess kurtosis", unit=""),
)
"""In the order in which they are offered, and kept where a page has no room for all."""


def tendon(signal: str) -> str:
    """Number of the tendon whose tension at the top a signal is; "" of another signal."""
    found = _TENDON.fullmatch(signal)
    return found[1] if found else ""


def signal_label(signal: str) -> str:
    """A signal in words: surge, tension of tendon 3; its name where it is neither."""
    if signal == ANY_TENDON:
        return "governing tension"
    if tendon(signal):
        return f"tension, tendon {tendon(signal)}"
    motion = _MOTION.fullmatch(signal)
    return motion[1] if motion else signal


def years_text(count: float) -> str:
    """So many years: 1 year, 100 years."""
    return f"{count:g} year" + ("" if count == 1.0 else "s")


def key_labels(keys: Sequence[str]) -> dict[str, str]:
    """Names of varied keys, in words and apart: "significant height", "waves heading", "wind speed"."""
    words = {key: [part.removesuffix("_deg").replace("_", " ") for part in key.split(".")] for key in keys}
    labels = {key: parts[-1] if " " in parts[-1] else " ".join(parts[-2:]) for key, parts in words.items()}
    twice = {label for label in labels.values() if list(labels.values()).count(label) > 1}
    return {key: " ".join(words[key]) if label in twice else label for key, label in labels.items()}


def key_unit(key: str) -> str:
    """Base unit of a scenario's key, printed; "" where it has none, or is no key of a scenario."""
    schema = _schema()
    place: Mapping[str, Any] = schema
    for part in key.split("."):
        reference = place.get("$ref", "")
        place = schema["$defs"][reference.rpartition("/")[2]] if reference else place
        place = place.get("properties", {}).get(part, {})
    return typeset(str(place.get("x-unit", "")))


@cache
def _schema() -> dict[str, Any]:
    return dict(json.loads((resources.files("tlpsim.scenarios") / "scenario.schema.json").read_text(encoding="utf-8")))


def value_text(value: Any, unit: str = "") -> str:
    """A setting with its unit: 12.5 m; text as it is."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool) or not isinstance(value, int | float):
        return json.dumps(value, default=str)
    if not math.isfinite(value):
        return UNKNOWN
    text = f"{value:.6g}".replace("-", "−") if abs(value) < 1e6 else short(float(value))
    return f"{text} {unit}".rstrip()


def variant_labels(variants: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """Each design alternative by its settings, "1: mass 4.05e+07 kg"; "" where there is one without settings."""
    if len(variants) == 1 and not variants[0]:
        return ("",)
    names = key_labels(list(dict.fromkeys(key for each in variants for key in each)))
    return tuple(
        f"{number}: " + (", ".join(f"{names[k]} {value_text(v, key_unit(k))}" for k, v in each.items()) or "as given")
        for number, each in enumerate(variants, 1)
    )
