"""How good the coupling of a system is: what its filters do to a band of frequencies, and what a run says of them.

`coupling_report` tells before a run, for each connection, which filter and which extrapolation serve it, and from
their responses to harmonics of a band: the error of the wanted part, the largest image (of a component that is faster
than its source) or alias (of one that is slower), the delay, and the error of values beyond the newest sample. The
horizon of these is that of the algorithm, whose order of steps is followed over a common period of the group.

`CouplingMeter` measures during a run, from its samples x_n of the step H alone, without knowing what lies between them:

    r_n = x_n - sum_k w_k(1/2) x_{n-1+2k}        each sample from its neighbours, by the connection's filter   (1)
    r_n = x_n - sum_k w_k x_{n-q-k}              each sample from those that were there q steps before it      (2)

(1) is the error at twice the step: with a filter of the order p that of the run itself is about 2^p times less. (2) is
that of the extrapolation itself, at the first sample at or after its horizon.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import WiringError
from tlpsim.loads.filters.interpolation import frequency_response, hermite_weights, report
from tlpsim.orchestrator.arrays import expanded
from tlpsim.orchestrator.clock import to_seconds
from tlpsim.orchestrator.loop.algorithms import order_of_ties
from tlpsim.orchestrator.loop.layout import REQUEST_OFFSETS, link_weights
from tlpsim.orchestrator.loop.links import LinkPlan, plan_links
from tlpsim.orchestrator.observers import Observer
from tlpsim.orchestrator.system import System, groups

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

BAND = 0.1
"""End of the band where nothing else is said, in cycles a sample of the slower of the two."""

_FREQUENCIES = 101
_LARGEST_RATIO = 1000  # phases of a filter that are looked at
_MOST_FOLDS = 200  # multiples of the target's sampling frequency, below half the source's
_MOST_STEPS = 20_000  # of a group, in which its order of steps is looked for
_ORDERS = {1: "hold", 2: "linear", 3: "quadratic"}


@dataclass(frozen=True, slots=True, kw_only=True)
class ConnectionReport:
    """What a connection does to a band of frequencies.

    Parameters
    ----------
    connection
        ``a.y -> b.u``.
    source_step, target_step
        In s.
    in_loop
        Whether both ends are in one loop.
    filter
        What finds values between samples; empty where none is asked for.
    band
        End of the band in Hz; it begins at zero.
    error
        Largest deviation from one of the complex gain in the band.
    image
        Largest gain of an image of the band, dB; minus infinity without one.
    alias
        Largest gain of what folds onto the band, dB; minus infinity where the target is not slower than the source.
    delay
        Largest delay in the band, s; negative for a lead.
    extrapolation
        What finds values beyond the newest sample; empty where none is asked for.
    horizon
        How far beyond, at most, s.
    extrapolation_error
        Error of a harmonic of the end of the band there, relative to its amplitude.
    """

    connection: str
    source_step: float
    target_step: float
    in_loop: bool
    filter: str
    band: float
    error: float
    image: float
    alias: float
    delay: float
    extrapolation: str
    horizon: float
    extrapolation_error: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ConnectionMeasure:
    """What a run says of a connection.

    Parameters
    ----------
    connection
        ``a.y -> b.u``.
    samples
        Number of samples that were predicted.
    deviation
        Standard deviation of the signal over them, in its unit.
    interpolation
        Root mean square of eq. (1) over that deviation: the error at twice the step; not a number where nothing is
        interpolated.
    extrapolation
        The same of eq. (2), the error at the horizon; not a number where nothing is extrapolated.
    """

    connection: str
    samples: int
    deviation: float
    interpolation: float
    extrapolation: float


@dataclass(slots=True)
class _Demand:
    """What a target asks of a source: values between samples, on them, and how far beyond the newest one, ns."""

    between: bool = False
    on_samples: bool = False
    beyond: int = 0


def _demands(system: System, plans: Sequence[LinkPlan]) -> list[_Demand]:
    """Demand of each link, from the order in which the components step."""
    steps = [component.step for component in system.components]
    offsets = [REQUEST_OFFSETS[component.inputs_at](component.step) for component in system.components]
    demands = [_Demand() for _ in plans]
    for group in groups(system):
        inner = [k for k, plan in enumerate(plans) if plan.target in group and not plan.looks_ahead]
        if not inner or system.algorithm == "iterative":
            continue
        order, times = order_of_ties(system, group), dict.fromkeys(group, 0)
        period = math.lcm(*(steps[member] for member in group))
        for _ in range(_MOST_STEPS):
            now = min(times.values())
            if now >= period:
                break
            due = [member for member in order if times[member] == now]
            stepping = due if system.algorithm == "parallel" else due[:1]
            for k in inner:
                if plans[k].target in stepping:
                    _ask(demands[k], now + offsets[plans[k].target], times[plans[k].source], steps[plans[k].source])
            for member in stepping:
                times[member] += steps[member]
    for plan, demand in zip(plans, demands, strict=True):
        if plan.looks_ahead or system.algorithm == "iterative":
            fitting = math.gcd(steps[plan.target], offsets[plan.target]) % steps[plan.source] == 0
            demand.between, demand.on_samples = not fitting, fitting
    return demands


def _ask(demand: _Demand, request: int, newest: int, step: int) -> None:
    if request > newest:
        demand.beyond = max(demand.beyond, request - newest)
    elif request % step:
        demand.between = True
    else:
        demand.on_samples = True


def coupling_report(system: System, band: float = BAND) -> list[ConnectionReport]:
    """What each connection of a system does to a band of frequencies.

    Parameters
    ----------
    system
        That has been checked.
    band
        End of the band in cycles a sample of the slower of the two components, up to one half.

    Raises
    ------
    WiringError
        If the band is not above zero and at most one half.
    """
    if not 0.0 < band <= 0.5:
        raise WiringError(f"coupling: the band ends at {band:g} cycles a sample; it must be above 0 and at most 0.5")
    system = expanded(system)
    plans = plan_links(system)
    found: dict[str, ConnectionReport] = {}
    for plan, demand in zip(plans, _demands(system, plans), strict=True):
        for name in _names(system, plan):
            found[name] = _report(system, plan, demand, band, name)
    return [found[str(connection)] for connection in system.connections]


def _names(system: System, plan: LinkPlan) -> list[str]:
    """The connections of a link as text."""
    target = system.components[plan.target].name
    by_input = {each.target_variable: str(each) for each in system.connections if each.target == target}
    return [by_input[name] for name in plan.inputs]


def _report(system: System, plan: LinkPlan, demand: _Demand, band: float, name: str) -> ConnectionReport:
    source, target = system.components[plan.source], system.components[plan.target]
    source_step, target_step = to_seconds(source.step), to_seconds(target.step)
    frequency = np.linspace(0.0, band / max(source_step, target_step), _FREQUENCIES)
    offset = REQUEST_OFFSETS[target.inputs_at](target.step)
    ratio = min(source.step // math.gcd(source.step, target.step, offset), _LARGEST_RATIO)
    derivatives = plan.interpolated - 1
    error, image, delay = 0.0, -math.inf, 0.0
    folds = _folding(float(frequency[-1]), source_step, target_step)
    levels = []
    text = ""
    if demand.between or (demand.on_samples and plan.smooth):
        figures = report(plan.filter, (0.0, float(frequency[-1])), source_step, ratio, derivatives)
        error, image = figures.pass_band_error, figures.worst_image
        gain = frequency_response(plan.filter, frequency[1:], source_step, ratio, derivatives)
        delay = _largest(-np.angle(gain) / (2.0 * np.pi * frequency[1:]))
        levels.append(np.abs(frequency_response(plan.filter, folds, source_step, ratio, derivatives)))
        kind = "by derivatives" if derivatives else "looks ahead" if plan.looks_ahead else "causal"
        text = f"{plan.filter.name}, {kind}"
    elif demand.on_samples:
        text = "samples as they are"
        levels.append(np.ones(len(folds)))
    beyond, horizon, far = "", to_seconds(demand.beyond), 0.0
    if demand.beyond:
        beyond = _extrapolation(plan)
        exact = np.exp(2j * np.pi * frequency[-1:] * horizon)
        far = float(np.abs(_beyond(plan, demand.beyond, source.step, frequency[-1:]) - exact)[0])
        levels.append(np.abs(_beyond(plan, demand.beyond, source.step, folds)))
    largest = max((float(level.max(initial=0.0)) for level in levels), default=0.0)
    return ConnectionReport(
        connection=name,
        source_step=source_step,
        target_step=target_step,
        in_loop=not plan.looks_ahead,
        filter=text,
        band=float(frequency[-1]),
        error=error,
        image=image,
        alias=20.0 * math.log10(largest) if largest > 0.0 else -math.inf,
        delay=delay,
        extrapolation=beyond,
        horizon=horizon,
        extrapolation_error=far,
    )


def _largest(values: FloatArray) -> float:
    return float(values[np.argmax(np.abs(values))])


def _folding(end: float, source_step: float, target_step: float) -> FloatArray:
    """Frequencies in Hz, up to half the source's sampling frequency, that fold onto the band of the target."""
    nyquist = 0.5 / source_step
    count = min(math.ceil(nyquist * target_step) + 1, _MOST_FOLDS)
    centres = np.arange(1, count + 1) / target_step
    found = np.add.outer(centres, np.linspace(-end, end, _FREQUENCIES)).ravel()
    return found[found <= nyquist] if target_step > source_step else np.zeros(0)


def _extrapolation(plan: LinkPlan) -> str:
    if plan.smooth:
        return f"line through {plan.filter.before} samples"
    if plan.extrapolated > 1:
        return f"{plan.extrapolated - 1} derivative{'s' if plan.extrapolated > 2 else ''}"
    return _ORDERS[plan.order + 1]


def _beyond(plan: LinkPlan, horizon: int, step: int, frequency: FloatArray) -> ComplexArray:
    """Response to harmonics of a value beyond the newest sample, which is at the time 0."""
    weights = link_weights(plan, -horizon, step)
    turn = 2j * np.pi * frequency
    if plan.extrapolated > 1 and not plan.smooth:
        return np.asarray(weights @ turn ** np.arange(len(weights))[:, np.newaxis])
    times = to_seconds(step) * np.arange(1 - len(weights), 1)
    return np.asarray(weights @ np.exp(np.outer(times, turn)))


class _Predictor:
    """Sums of squares of eq. (1) or (2) for the signals of one link.

    Parameters
    ----------
    columns
        Of the source's outputs, rows as those of `LinkPlan.columns`.
    taps
        Places of the samples that are used, from the one that is predicted, rows, and weights.
    """

    def __init__(self, columns: NDArray[np.intp], taps: Sequence[tuple[int, int, float]]) -> None:
        self.columns, self.taps = columns, taps
        self.first = min(0, *(place for place, _, _ in taps))
        self.span = max(0, *(place for place, _, _ in taps)) - self.first
        self.count = 0
        self._reference: FloatArray | None = None
        self._sums = np.zeros((3, columns.shape[1]))

    def take(self, block: FloatArray, new: int) -> None:
        """Predict what has become complete by the last `new` rows of a block."""
        low, high = max(len(block) - new, self.span) - self.span, len(block) - self.span
        if high <= low:
            return

        def rows(place: int, row: int) -> FloatArray:
            begin = place - self.first
            return np.asarray(block[low + begin : high + begin, self.columns[row]])

        actual = rows(0, 0)
        residual = actual.copy()
        for place, row, weight in self.taps:
            residual -= weight * rows(place, row)
        if self._reference is None:
            self._reference = actual[0].copy()  # takes a large mean out of the squares
        moved = actual - self._reference
        self._sums += np.array([(residual**2).sum(axis=0), moved.sum(axis=0), (moved**2).sum(axis=0)])
        self.count += high - low

    def figures(self, signal: int) -> tuple[float, float]:
        """Root mean square residual over the standard deviation, and that deviation."""
        if not self.count:
            return math.nan, math.nan
        square, first, second = self._sums[:, signal] / self.count
        deviation = math.sqrt(max(second - first**2, 0.0))
        return (math.sqrt(square) / deviation if deviation > 0.0 else math.nan), deviation


class CouplingMeter(Observer):
    """Measures the errors of interpolation and extrapolation from the samples of a run, eqs. (1) and (2)."""

    def __init__(self) -> None:
        self._between: list[_Predictor | None] = []
        self._beyond: list[_Predictor | None] = []
        self._tails: list[FloatArray | None] = []
        self._plans: list[LinkPlan] = []
        self._system: System | None = None

    def started(self, system: System) -> None:
        """Forget what was measured before."""
        self._system = system
        self._plans = plan_links(system)
        demands = _demands(system, self._plans)
        steps = [system.components[plan.source].step for plan in self._plans]
        triples = list(zip(self._plans, demands, steps, strict=True))
        self._between = [_by_neighbours(*triple) for triple in triples]
        self._beyond = [_by_newest(*triple) for triple in triples]
        self._tails = [None] * len(system.components)

    def sampled(self, index: int, times: NDArray[np.int64], values: FloatArray) -> None:
        """Predict samples of a component; see `Observer`."""
        predictors = [
            predictor
            for plan, *both in zip(self._plans, self._between, self._beyond, strict=True)
            for predictor in both
            if plan.source == index and predictor is not None
        ]
        if not predictors:
            return
        tail = self._tails[index]
        block = values if tail is None else np.concatenate([tail, values])
        for predictor in predictors:
            predictor.take(block, len(values))
        self._tails[index] = block[-max(predictor.span for predictor in predictors) :].copy()

    def measures(self) -> list[ConnectionMeasure]:
        """What was measured, for each connection in the order of the system."""
        if self._system is None:
            return []
        found: dict[str, ConnectionMeasure] = {}
        for plan, between, beyond in zip(self._plans, self._between, self._beyond, strict=True):
            for signal, name in enumerate(_names(self._system, plan)):
                figures = [(math.nan, math.nan) if each is None else each.figures(signal) for each in (between, beyond)]
                counts = [each.count for each in (between, beyond) if each is not None]
                deviations = [deviation for _, deviation in figures if not math.isnan(deviation)]
                found[name] = ConnectionMeasure(
                    connection=name,
                    samples=max(counts, default=0),
                    deviation=deviations[0] if deviations else math.nan,
                    interpolation=figures[0][0],
                    extrapolation=figures[1][0],
                )
        return [found[str(connection)] for connection in self._system.connections]


def _by_neighbours(plan: LinkPlan, demand: _Demand, step: int) -> _Predictor | None:
    """Eq. (1), with derivatives where the link has them."""
    if plan.smooth or not demand.between:
        return None
    if plan.interpolated > 1:
        rows = hermite_weights(plan.interpolated - 1, 0.5, 2.0 * to_seconds(step))
    else:
        rows = plan.filter.weights(0.5)[np.newaxis]
    places = 2 * np.arange(1 - plan.filter.before, plan.filter.after + 1) - 1
    taps = [
        (int(place), row, float(weight))
        for row, weights in enumerate(rows)
        for place, weight in zip(places, weights, strict=True)
    ]
    return _Predictor(plan.columns, taps)


def _by_newest(plan: LinkPlan, demand: _Demand, step: int) -> _Predictor | None:
    """Eq. (2)."""
    if not demand.beyond:
        return None
    ahead = -(-demand.beyond // step)
    weights = link_weights(plan, -ahead * step, step).tolist()
    if plan.extrapolated > 1 and not plan.smooth:
        return _Predictor(plan.columns, [(-ahead, row, weight) for row, weight in enumerate(weights)])
    last = len(weights) - 1
    return _Predictor(plan.columns, [(k - last - ahead, 0, weight) for k, weight in enumerate(weights)])
