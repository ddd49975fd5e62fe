"""A platform in wind and waves in one loop: forces at its own position and velocity at every step.

    x* = x_n + h v_n + h²/2 a_n,   v* = v_n + h (3/2 a_n - 1/2 a_{n-1})                               (1)
    Q_{n+1} = Q_ext + Q_wind(t_{n+1}, x*, v*) + Q_wave(t_{n+1}, x*, v*)                               (2)
    (x, v, a)_{n+1} from (x, v, a)_n with the load linear from Q_n to Q_{n+1}                         (3)

Eq. (1) is Taylor's series for the position and the two-step Adams-Bashforth rule for the velocity; they miss by
h³/6 x''' and 5/12 h³ v'', so the forces are those of the end of the step but for the third order in h. A correction
repeats eqs. (2) and (3) with the x and v that they gave. Eq. (3) is `tlpsim.loads.platform.motion.advance`.

Nothing is held, interpolated or extrapolated between parts of the model. That makes this loop the reference for what a
co-simulation of the same parts adds, and the shortest time in which they can be computed.

The loop exists twice. The plain form calls the models' public functions, the compiled form
(`tlpsim.loads.compiled_loop`) their kernels. Every simulation begins with both. The compiled one goes on if it repeats
the first steps of the plain one to rounding, and the plain one otherwise, so that a model whose public functions do
more than its kernels is never computed with less.
"""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Generator, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.compiled_loop import CompiledLoop
from tlpsim.loads.errors import StepError
from tlpsim.loads.hydro.excitation import PARTS, ROWS, WaveLoads
from tlpsim.loads.platform.motion import PlatformModel, advance, initial_state
from tlpsim.loads.platform.state import PlatformState, fit_history
from tlpsim.loads.wind.force import WindLoads

FloatArray = NDArray[np.float64]

BLOCK = 2000
"""Steps of one record."""
_COMPARED = 5  # steps that both forms of the loop take
_ROUNDING = 1e-9  # relative difference of the two forms


@dataclass(frozen=True, slots=True, kw_only=True)
class CoupledModel:
    """A platform and what acts on it; None for no wind or no waves and current.

    Attributes
    ----------
    platform, wind, waves
        The models.
    external
        Constant load, (6,) N, N·m, earth-fixed, about the reference point.
    """

    platform: PlatformModel
    wind: WindLoads | None = None
    waves: WaveLoads | None = None
    external: FloatArray = dataclasses.field(default_factory=lambda: np.zeros(6))


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """Successive samples of a simulation, m of them.

    Attributes
    ----------
    first
        Number of the first sample; sample n belongs to the time n h.
    position, velocity, acceleration
        Of the platform, (m, 6) m, rad and their time derivatives.
    tensions, bottom_tensions
        At the upper and the lower ends of the tendons, (m, tendons) N.
    wind_force, wind_speed
        (m, 6) N, N·m; and (m,) m/s, area-weighted mean over the segments.
    wave_force, wave_parts, elevation
        Sum (m, 6) N, N·m, its parts by name, and (m,) m at the place where the waves are taken.
    """

    first: int
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    tensions: FloatArray
    bottom_tensions: FloatArray
    wind_force: FloatArray
    wind_speed: FloatArray
    wave_force: FloatArray
    wave_parts: Mapping[str, FloatArray]
    elevation: FloatArray


def start(
    model: CoupledModel, position: FloatArray, velocity: FloatArray, intact: NDArray[np.bool_] | None = None
) -> PlatformState:
    """State at time zero, with the acceleration of the loads there.

    Parameters
    ----------
    position, velocity
        (6,) m, rad and per second.
    intact
        False for a tendon that is lost, (tendons,); all intact by default.

    Raises
    ------
    ScenarioError
        For a wrong shape or a value that is not finite.
    """
    rates = np.where(model.platform.free, velocity, 0.0)
    wind, waves = _loads(model, 0.0, np.asarray(position, dtype=np.float64), rates)
    return initial_state(model.platform, position, rates, model.external + wind + _sum(waves), intact)


def simulate(
    model: CoupledModel,
    state: PlatformState,
    *,
    step: float,
    steps: int,
    first: int = 0,
    corrections: int = 0,
    compiled: bool = True,
) -> Generator[Record, None, None]:
    """Samples of the motion from time zero on, a record of one sample first; or those after sample `first`.

    Parameters
    ----------
    state
        That of `start`, or of sample `first`; moved to the end.
    step, steps
        h in s, and their number.
    first
        Number of the sample that `state` is at. A simulation may go on with another model; at its first step the
        velocity of eq. (1) is without the acceleration of the step before.
    corrections
        Repetitions of eqs. (2) and (3).
    compiled
        False for the plain form of the loop.

    Raises
    ------
    StepError
        When the motion does not converge or a load is not finite; the message names the time.

    Warns
    -----
    RuntimeWarning
        When the plain form has to take the place of the compiled one.
    """
    if first == 0:
        yield _first_record(model, state)
    if steps < 1:
        return
    blocks = [(begin, min(BLOCK, first + steps - begin)) for begin in range(first, first + steps, BLOCK)]
    loop = _compiled_loop(model, state, step, first, corrections) if compiled else None
    if loop is None:
        yield from _plain_records(model, state, step, blocks, corrections)
    else:
        yield from _compiled_records(model, state, loop, blocks)


def _plain_records(
    model: CoupledModel, state: PlatformState, step: float, blocks: Sequence[tuple[int, int]], corrections: int
) -> Iterator[Record]:
    before = state.acceleration.copy()
    for first, count in blocks:
        arrays = Arrays(model, count)
        _plain(model, state, before, step, first, corrections, arrays)
        yield _record(model, first + 1, arrays)


def _compiled_records(
    model: CoupledModel, state: PlatformState, loop: CompiledLoop, blocks: Sequence[tuple[int, int]]
) -> Iterator[Record]:
    """The compiled form in a thread of its own, while this one makes the gusts and waves of the next block."""
    before = state.acceleration.copy()
    done: tuple[int, Arrays] | None = None
    with ThreadPoolExecutor(max_workers=1) as thread:
        running = None
        for first, count in blocks:
            arrays, amplitudes = Arrays(model, count), loop.amplitudes(first, count)
            arrays.fluctuation[:] = loop.gusts(first, count)
            if running is not None:
                running.result()
            running = thread.submit(loop, state, before, first, arrays, amplitudes)
            if done is not None:
                yield _record(model, done[0] + 1, done[1])
            done = first, arrays
        assert running is not None
        assert done is not None
        running.result()
        yield _record(model, done[0] + 1, done[1])


class Arrays:
    """Room for what a block of steps takes from the gusts and gives."""

    def __init__(self, model: CoupledModel, count: int) -> None:
        self.fluctuation = np.zeros((count, 0 if model.wind is None else len(model.wind.segments.area)))
        self.motion = np.empty((count, 18 + 2 * len(model.platform.tendons.pretension)))
        self.wind = np.empty((count, 6))
        self.waves = np.empty((count, ROWS))


def _loads(
    model: CoupledModel, time: float, position: FloatArray, velocity: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Wind force (6,), and elevation and parts of the wave force (25,)."""
    wind = np.zeros(6) if model.wind is None else model.wind.evaluate(time, velocity, float(position[5]))
    waves = np.zeros(ROWS)
    if model.waves is not None:
        forces = model.waves.evaluate(time, position, velocity)
        waves[0] = forces.elevation
        for name, part in PARTS.items():
            waves[part] = getattr(forces, name)
    return wind, waves


def _sum(waves: FloatArray) -> FloatArray:
    return np.asarray(sum(waves[..., part] for part in PARTS.values()))


def _first_record(model: CoupledModel, state: PlatformState) -> Record:
    arrays = Arrays(model, 1)
    if model.wind is not None:
        arrays.fluctuation[0] = model.wind.field.fluctuation(0.0)
    arrays.wind[0], arrays.waves[0] = _loads(model, 0.0, state.position, state.velocity)
    _write_motion(state, arrays.motion[0])
    return _record(model, 0, arrays)


def _write_motion(state: PlatformState, row: FloatArray) -> None:
    parts = state.position, state.velocity, state.acceleration, state.tensions, state.bottom_tensions
    np.concatenate(parts, out=row)


def _record(model: CoupledModel, first: int, arrays: Arrays) -> Record:
    speed = np.zeros(len(arrays.motion))
    if model.wind is not None:
        share = model.wind.segments.area / model.wind.segments.area.sum()
        speed = (model.wind.field.speed + arrays.fluctuation) @ share
    motion, waves = arrays.motion, arrays.waves
    ends = np.hsplit(motion[:, 18:], 2)
    return Record(
        first=first,
        position=motion[:, :6],
        velocity=motion[:, 6:12],
        acceleration=motion[:, 12:18],
        tensions=ends[0],
        bottom_tensions=ends[1],
        wind_force=arrays.wind,
        wind_speed=speed,
        wave_force=_sum(waves),
        wave_parts={name: waves[:, part] for name, part in PARTS.items()},
        elevation=waves[:, 0],
    )


# The plain form


def _plain(
    model: CoupledModel,
    state: PlatformState,
    before: FloatArray,
    step: float,
    first: int,
    corrections: int,
    arrays: Arrays,
) -> None:
    for k in range(len(arrays.motion)):
        time = (first + k + 1) * step
        position = state.position + step * state.velocity + 0.5 * step**2 * state.acceleration
        velocity = state.velocity + step * (1.5 * state.acceleration - 0.5 * before)
        before[:] = state.acceleration
        begin = state.copy() if corrections else state
        for repetition in range(corrections + 1):
            if repetition:
                position, velocity = state.position.copy(), state.velocity.copy()
                _restore(state, begin)
            wind, waves = _loads(model, time, position, velocity)
            try:
                advance(model.platform, state, model.external + wind + _sum(waves), step)
            except StepError as error:
                raise StepError(f"at t = {time:.9g} s: {error}") from error
        arrays.wind[k], arrays.waves[k] = wind, waves
        if model.wind is not None:
            arrays.fluctuation[k] = model.wind.field.fluctuation(time)
        _write_motion(state, arrays.motion[k])


def _restore(state: PlatformState, saved: PlatformState) -> None:
    for each in dataclasses.fields(PlatformState):
        setattr(state, each.name, getattr(saved, each.name).copy())


# The compiled form


def _compiled_loop(
    model: CoupledModel, state: PlatformState, step: float, first: int, corrections: int
) -> CompiledLoop | None:
    """The compiled form, or None where it does not repeat the first steps of the plain one."""
    plain, trial = state.copy(), state.copy()
    expected, found = (Arrays(model, _COMPARED) for _ in range(2))
    _plain(model, plain, state.acceleration.copy(), step, first, corrections, expected)
    for each in (state, trial):
        fit_history(each, float(plain.memory_step[0]), len(plain.history), len(plain.filters))
    loop = CompiledLoop(model, state, step, corrections)
    found.fluctuation[:] = loop.gusts(first, _COMPARED)
    loop(trial, state.acceleration.copy(), first, found, loop.amplitudes(first, _COMPARED))
    pairs = (found.motion, expected.motion), (found.wind, expected.wind), (found.waves, expected.waves)
    if all(_close(one, other) for one, other in pairs):
        return loop
    warnings.warn(
        "the compiled loop does not repeat the models' first steps; the plain one is taken, at a third of the speed",
        RuntimeWarning,
        stacklevel=3,
    )
    return None


def _close(one: FloatArray, other: FloatArray) -> bool:
    """Whether columns agree to rounding, relative to the largest value of the column."""
    size = np.max(np.abs(other), axis=0)
    return bool(np.all(np.abs(one - other) <= _ROUNDING * np.maximum(size, _ROUNDING * size.max(initial=0.0))))
