"""What a run comes to: the response as in Table I of Li and Kareem (1990), and extreme tensions."""

import re
from dataclasses import dataclass

import numpy as np

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.orchestrator.units import unit_conversion
from tlpsim.scenarios.results import Results
from tlpsim.scenarios.statistics.bands import BAND_EDGES, band_statistics, first_sample

# Display unit of each degree of freedom in Table I, and how many there are in the SI unit.
TABLE_UNITS = {
    "surge": ("m", 1.0),
    "sway": ("m", 1.0),
    "heave": ("cm", 1e2),
    "roll": ("1e-4 rad", 1e4),
    "pitch": ("1e-4 rad", 1e4),
    "yaw": ("1e-2 rad", 1e2),
}
_SI_UNITS = {degree: "rad" if unit.endswith("rad") else "m" for degree, (unit, _) in TABLE_UNITS.items()}


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponseRow:
    """Response in one degree of freedom: a row of Table I, with total and extremes, in the table's unit."""

    name: str
    unit: str
    mean: float
    low_frequency: float
    wave_frequency: float
    std: float
    maximum: float
    minimum: float


def conversion(unit: str, wanted: str) -> float:
    """Factor from the unit of a recorded signal, an FMU's own, to the one wanted; 1 where it is not known."""
    try:
        return unit_conversion(unit, wanted, {}, {})[0]
    except ValueError:
        return 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TensionExtremes:
    """Highest and lowest tension over all tendons, N, with the tendon and the time (s) of each."""

    maximum: float
    maximum_tendon: str
    maximum_time: float
    minimum: float
    minimum_tendon: str
    minimum_time: float

    def __str__(self) -> str:
        return (
            f"tension: maximum {self.maximum / 1e6:.3f} MN ({self.maximum_tendon} at {self.maximum_time:g} s), "
            f"minimum {self.minimum / 1e6:.3f} MN ({self.minimum_tendon} at {self.minimum_time:g} s)"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """What a run comes to.

    Attributes
    ----------
    description : str
        Which part of the record was evaluated.
    motions : tuple[ResponseRow, ...]
        A row for each recorded degree of freedom, in their order.
    tensions : TensionExtremes or None
        None when no tension was recorded.
    notes : tuple[str, ...]
        What the reader must know of how it was evaluated.
    """

    description: str
    motions: tuple[ResponseRow, ...]
    tensions: TensionExtremes | None
    notes: tuple[str, ...]

    @property
    def lines(self) -> tuple[str, ...]:
        """What goes below the table of motions: tensions and notes."""
        tensions = () if self.tensions is None else (str(self.tensions),)
        return (*tensions, *(f"note: {note}" for note in self.notes))


def summary(results: Results, start: float | None = None, component: str = "platform") -> Summary:
    """Response in the degrees of freedom and extreme tensions.

    Parameters
    ----------
    results : Results
        Results of a run.
    start : float, optional
        Time before which samples are left out, s; the scenario's ``outputs.statistics_from`` if not given.
    component : str
        Component whose ``position.*`` and ``tendon_tension[n]`` are taken.
    """
    if component not in results.components:
        return Summary(description="no platform", motions=(), tensions=None, notes=())
    start = results.scenario.outputs.statistics_from if start is None else start
    time = results.time(component)
    recorded = results.signals(component)
    first, note = first_sample(time, start, BAND_EDGES[0])
    motions = []
    notes = [note] if note else []
    for degree in DEGREES_OF_FREEDOM:
        if f"position.{degree}" not in recorded:
            continue
        unit, factor = TABLE_UNITS[degree]
        name = f"{component}.position.{degree}"
        signal = factor * conversion(results.unit(name), _SI_UNITS[degree]) * results.signal(name)
        statistics = band_statistics(time, signal, start=start)
        notes += [statistics.note] if statistics.note else []
        motions.append(
            ResponseRow(
                name=degree,
                unit=unit,
                mean=statistics.mean,
                low_frequency=statistics.low_frequency,
                wave_frequency=statistics.wave_frequency,
                std=statistics.std,
                maximum=statistics.maximum,
                minimum=statistics.minimum,
            )
        )
    return Summary(
        description=f"{time[first]:g} to {time[-1]:g} s" if len(time) else "no samples",
        motions=tuple(motions),
        tensions=extreme_tensions(results, start, component),
        # Each row has the same notes; a longer one holds a shorter one.
        notes=tuple(n for n in dict.fromkeys(notes) if not any(n != other and n in other for other in notes)),
    )


def extreme_tensions(results: Results, start: float = 0.0, component: str = "platform") -> TensionExtremes | None:
    """Extremes of the recorded ``tendon_tension[n]`` of a component, or None if there are none.

    Parameters
    ----------
    results : Results
        Results of a run.
    start : float
        Time before which samples are left out, s, by the rule of `band_statistics`.
    component : str
        Component whose tensions are taken.
    """
    names = [name for name in results.signals(component) if re.fullmatch(r"tendon_tension\[\d+\]", name)]
    time = results.time(component)
    if not names or not len(time):
        return None
    first, _ = first_sample(time, start, BAND_EDGES[0])
    factors = [conversion(results.unit(f"{component}.{name}"), "N") for name in names]
    tensions = np.stack(
        [factor * results.signal(f"{component}.{name}")[first:] for name, factor in zip(names, factors, strict=True)]
    )
    highest, when_highest = np.unravel_index(int(np.argmax(tensions)), tensions.shape)
    lowest, when_lowest = np.unravel_index(int(np.argmin(tensions)), tensions.shape)
    return TensionExtremes(
        maximum=float(tensions[highest, when_highest]),
        maximum_tendon=names[highest],
        maximum_time=float(time[first + when_highest]),
        minimum=float(tensions[lowest, when_lowest]),
        minimum_tendon=names[lowest],
        minimum_time=float(time[first + when_lowest]),
    )
