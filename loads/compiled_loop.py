"""The compiled form of the loop of `tlpsim.loads.simulation`, from the kernels of its models.

Waves. The amplitudes a of the sea at its sampling instants t_k are turned to the time within the sample; this is exact:

    a(t_k + s) = a(t_k) exp(i omega s)                                                                (1)

Those of many sampling instants are one product of matrices.

Gusts. The samples of the wind are asked for once each, and interpolated at all steps of a block together by the filter
that the wind field has (`tlpsim.loads.wind.field`).

Memory of radiated waves. Where it is a convolution of N past velocities with taps W_k, it would take most of the time.
In blocks of B steps it is

    sum_{k=1..N} W_k v_{n-k} = sum_{k=1..B} W_k v_{n-k} + z_n,   z_n = sum_{k=B+1..N} W_k v_{n-k}      (2)

in which z depends on velocities before the block alone, so that one pass over the taps serves all of its steps. To the
integrator z is a recursive filter that keeps its value (eq. (1) of `tlpsim.loads.platform.memory`, Z = C = 1, G = 0).

The rest is that of the models. The cache of the compiled code sees changes of this file only: after a change of a
model's kernel, this file's has to be made anew.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController  # type: ignore[import-untyped]

from tlpsim.loads.errors import StepError
from tlpsim.loads.hydro.excitation import _FORCE_ROWS, WaveLoads, _wave_forces
from tlpsim.loads.hydro.linear_rows import linear_rows
from tlpsim.loads.hydro.splash import splash_drag
from tlpsim.loads.platform.integration import integrate
from tlpsim.loads.platform.memory import DiscreteMemory
from tlpsim.loads.platform.motion import METHODS, advance
from tlpsim.loads.platform.state import PlatformState
from tlpsim.loads.waves.elevation import ArmaSea
from tlpsim.loads.waves.field import calm_water
from tlpsim.loads.waves.sea import Sea
from tlpsim.loads.wind.field import _FILTER as GUST_FILTER
from tlpsim.loads.wind.field import SpeedField
from tlpsim.loads.wind.force import WindLoads, _wind_force

if TYPE_CHECKING:
    from tlpsim.loads.simulation import Arrays, CoupledModel

FloatArray = NDArray[np.float64]

_BLOCK_OF_MEMORY = 32  # B of eq. (2)
_INSTANTS = 512  # at which amplitudes are made together
_HARMONIC_STEPS = 16  # between two evaluations of a sea whose amplitudes turn for ever by eq. (1)
_PHASES = 10**9  # time is resolved to this part of a sampling step of the gusts
_CACHED_PHASES = 4096
_WHOLE = 1e-9  # relative deviation from a whole number that is rounding
_STATE = tuple(each.name for each in dataclasses.fields(PlatformState) if each.name != "memory_step")


@njit(cache=True)
def _distant_past(history, newest, pairs, taps, velocity, result):  # type: ignore[no-untyped-def]
    """z of eq. (2) for the next B steps into `result` (6, B), from the ring of velocities and `taps` (pairs, N - B).

    `velocity` (6, N - 1) is room for the velocities, oldest first.
    """
    size, length, rows = result.shape[1], velocity.shape[1], history.shape[0]
    for t in range(length):
        slot = (newest - (length - 1 - t)) % rows
        for j in range(6):
            velocity[j, t] = history[slot, j]
    result[:] = 0.0
    for p in range(pairs.shape[0]):
        total, source = result[pairs[p, 0]], velocity[pairs[p, 1]]
        for k in range(taps.shape[1]):
            weight = taps[p, k]
            past = source[taps.shape[1] - 1 - k : taps.shape[1] - 1 - k + size]
            for step in range(size):
                total[step] += weight * past[step]


@njit(cache=True, nogil=True)
def _run(  # type: ignore[no-untyped-def]
    first,
    h,
    substeps,
    beta,
    corrections,
    stride,
    external,
    state,
    before,
    fluctuation,
    wind,
    amplitudes,
    turn,
    factor,
    waves,
    splash,
    platform,
    distant,
    motion,
    wind_force,
    wave_force,
):
    """Steps of a block, -1; or the number of the step that failed, with the state before it."""
    position, velocity, acceleration, force, tensions, bottom_tensions = state[:6]
    history, cursor, filters = state[-3], state[-2], state[-1]
    pairs, taps, past_velocity, past = distant
    tendons = len(tensions)
    response = waves[0][-1]
    turned = np.empty(amplitudes.shape[1], dtype=np.complex128)
    x, v, load = np.empty(6), np.empty(6), np.empty(6)
    saved, saved_filters = np.empty((4, 6)), np.empty(len(filters))
    for k in range(motion.shape[0]):
        number = first + k + 1
        anchor, phase = number // stride - (first + 1) // stride, number % stride
        for n in range(len(turned)):
            turned[n] = amplitudes[anchor, n] * turn[phase, n]
        for i in range(6):
            x[i] = position[i] + h * velocity[i] + 0.5 * h * h * acceleration[i]
            v[i] = velocity[i] + h * (1.5 * acceleration[i] - 0.5 * before[i])
        before[:] = acceleration
        saved[0], saved[1], saved[2], saved[3] = position, velocity, acceleration, force
        newest = cursor[0]
        if taps.shape[1] > 0:
            if k % past.shape[1] == 0:
                _distant_past(history, newest, pairs, taps, past_velocity, past)
            filters[:] = past[:, k % past.shape[1]]
        saved_filters[:] = filters
        for repetition in range(corrections + 1):
            if repetition > 0:
                x[:], v[:] = position, velocity
                position[:], velocity[:], acceleration[:], force[:] = saved[0], saved[1], saved[2], saved[3]
                filters[:] = saved_filters
                cursor[0] = newest
            _wind_force(wind, fluctuation[k], v, x[5], wind_force[k])
            rows = wave_force[k]
            _wave_forces(turned, factor * x[0], factor * x[1], v, *waves, rows)
            if splash[0].shape[0] > 0:
                splash_drag(response, x, v, *splash, rows[7:13])
            for i in range(6):
                load[i] = external[i] + wind_force[k, i] + rows[1 + i] + rows[7 + i] + rows[13 + i] + rows[19 + i]
            if integrate(*state, load, h / substeps, substeps, beta, *platform) != 0:
                return k
        motion[k, :6], motion[k, 6:12], motion[k, 12:18] = position, velocity, acceleration
        motion[k, 18 : 18 + tendons], motion[k, 18 + tendons :] = tensions, bottom_tensions
    return -1


class CompiledLoop:
    """The compiled form with its arrays, called once a block.

    Parameters
    ----------
    model
        What is simulated.
    state
        One whose ring of velocities has its size and step, see `tlpsim.loads.platform.state.fit_history`.
    step
        In s.
    corrections
        Of a step.
    """

    def __init__(self, model: CoupledModel, state: PlatformState, step: float, corrections: int) -> None:
        platform = model.platform
        substep = float(state.memory_step[0])
        self._model, self._step, self._corrections = model, step, corrections
        self._substeps = round(step / substep)
        memory, self._distant = _split_memory(platform.memory.discrete(substep), self._substeps)
        self._platform = _owned((*platform.arrays, *memory.arrays))
        self._filters = np.zeros(6) if self._distant[1].size else None
        self._wind = _wind_arrays(model.wind)
        self._gusts = _Gusts(model.wind)
        self._waves, self._splash, self._factor = _wave_arrays(model.waves)
        self._stride, turn = 1, np.ones((1, 0), dtype=np.complex128)
        if model.waves is not None:
            sea = model.waves.sea
            self._stride = _stride(getattr(sea, "sampling_step", None), step)
            turn = np.exp(1j * np.multiply.outer(step * np.arange(self._stride), sea.angular_frequency))
        self._turn = turn
        self._amplitudes = _amplitudes(None if model.waves is None else model.waves.sea, self._stride * step)

    def __call__(
        self,
        state: PlatformState,
        before: FloatArray,
        first: int,
        arrays: Arrays,
        amplitudes: NDArray[np.complex128],
    ) -> None:
        """Steps of a block from `first` on; `before` is a_{n-1} of eq. (1)."""
        model = self._model
        filters = state.filters if self._filters is None else self._filters
        failed = _run(
            first,
            self._step,
            self._substeps,
            METHODS[model.platform.method],
            self._corrections,
            self._stride,
            model.external,
            (*(getattr(state, name) for name in _STATE[:-1]), filters),
            before,
            arrays.fluctuation,
            self._wind,
            amplitudes,
            self._turn,
            self._factor,
            self._waves,
            self._splash,
            self._platform,
            self._distant,
            arrays.motion,
            arrays.wind,
            arrays.waves,
        )
        if failed < 0:
            return
        time = (first + failed + 1) * self._step
        load = model.external + arrays.wind[failed] + arrays.waves[failed, 1:].reshape(-1, 6).sum(axis=0)
        try:
            advance(model.platform, state, load, self._step)
        except StepError as error:
            raise StepError(f"at t = {time:.9g} s: {error}") from error
        raise StepError(f"at t = {time:.9g} s: the platform's motion failed; reduce the step")

    def amplitudes(self, first: int, count: int) -> NDArray[np.complex128]:
        """Amplitudes of the sea at the instants from which eq. (1) goes, (instants, N)."""
        anchors = (first + 1) // self._stride, (first + count) // self._stride + 1
        if self._model.waves is None:
            return np.zeros((anchors[1] - anchors[0], 0), dtype=np.complex128)
        return self._amplitudes(*anchors)

    def gusts(self, first: int, count: int) -> FloatArray:
        """Fluctuation of the wind at the segments at the steps after `first`, (count, segments) m/s."""
        return self._gusts(np.asarray((first + 1 + np.arange(count)) * self._step, dtype=np.float64))


def _amplitudes(sea: Sea | None, interval: float) -> Callable[[int, int], NDArray[np.complex128]]:
    """Function of two whole numbers: amplitudes of a sea at times from the one to before the other, in intervals."""
    if not isinstance(sea, ArmaSea) or abs(interval / sea.sampling_step - 1.0) > _WHOLE:
        return lambda first, last: np.array([sea.amplitudes(n * interval) for n in range(first, last)])  # type: ignore[union-attr]
    # Eq. (2) of `tlpsim.loads.waves.elevation` at many instants together: the newest sample has the first weight.
    unit = np.eye(len(sea.frequency), dtype=np.complex128)
    weights = np.vstack([sea.kernels(unit), -sea.kernels(np.asarray(1j * unit, dtype=np.complex128))])[:, ::-1].T.copy()
    half, size, library = sea.half, len(unit), ThreadpoolController()

    def together(first: int, last: int) -> NDArray[np.complex128]:
        # Always as many rows, so that the linear algebra library takes the same way, bit for bit, to any end.
        rows = -(-(last - first) // _INSTANTS) * _INSTANTS
        samples = sea.samples(first - half, last - first + 2 * half)
        windows = np.zeros((samples.shape[1], rows, 2 * half + 1))
        for direction, elevation in enumerate(samples.T):
            windows[direction, : last - first] = np.lib.stride_tricks.sliding_window_view(elevation, 2 * half + 1)
        with library.limit(limits=1):  # the loop has the other core
            sums = windows @ weights
        result = sums[..., :size] + 1j * sums[..., size:]
        return np.ascontiguousarray(result.transpose(1, 0, 2)).reshape(rows, -1)[: last - first]

    return together


class _Gusts:
    """Fluctuations of a wind field at successive times."""

    def __init__(self, wind: WindLoads | None) -> None:
        self._field = None if wind is None else wind.field
        self._first, self._samples = 0, np.zeros((0, 0 if wind is None else len(wind.segments.area)))
        self._weights: dict[int, FloatArray] = {}

    def __call__(self, times: FloatArray) -> FloatArray:
        """At `times` (m,) s, which follow those of the last call; (m, segments) m/s."""
        field = self._field
        if field is None:
            return np.zeros((len(times), 0))
        step = getattr(field, "sampling_step", None)
        if step is None:
            return np.array([field.fluctuation(time) for time in times.tolist()])
        index, phase = np.divmod(np.rint(times / step * _PHASES).astype(np.int64), _PHASES)
        behind = GUST_FILTER.before - 1
        # The first samples reach back to before time zero, where the field cannot be asked.
        early = int(np.count_nonzero(index < behind))
        result = np.empty((len(times), self._samples.shape[1]))
        for k in range(early):
            result[k] = field.fluctuation(float(times[k]))
        if early == len(times):
            return result
        self._reach(field, step, int(index[early]) - behind, int(index[-1]) + GUST_FILTER.after)
        rows = index[early:, None] + np.arange(-behind, GUST_FILTER.after + 1) - self._first
        weights = np.array([self._at_phase(each) for each in phase[early:].tolist()])
        result[early:] = np.einsum("mk,mks->ms", weights, self._samples[rows])
        return result

    def _reach(self, field: SpeedField, step: float, first: int, last: int) -> None:
        """Hold the samples `first` to `last`."""
        held = self._first + len(self._samples)
        kept = self._samples[max(first - self._first, 0) :]
        new = [field.fluctuation(k * step) for k in range(max(held, first), last + 1)]
        self._first = first
        self._samples = np.vstack([kept, *new])

    def _at_phase(self, phase: int) -> FloatArray:
        if len(self._weights) > _CACHED_PHASES:
            self._weights.clear()
        if phase not in self._weights:
            self._weights[phase] = GUST_FILTER.weights(phase / _PHASES)
        return self._weights[phase]


def _split_memory(memory: DiscreteMemory, substeps: int) -> tuple[DiscreteMemory, tuple[Any, ...]]:
    """The memory of the last B steps, which carries z of eq. (2), and what z is made from; no split of a short one."""
    size, length = _BLOCK_OF_MEMORY, len(memory.taps)
    if substeps > 1 or length <= 2 * size or len(memory.transition):
        return memory, _owned((memory.pairs, np.zeros((len(memory.pairs), 0)), np.zeros((6, 0)), np.zeros((6, 1))))
    recent = dataclasses.replace(
        memory,
        taps=np.ascontiguousarray(memory.taps[:size]),
        transition=np.eye(6),
        drive=np.zeros((6, 6)),
        output=np.eye(6),
        extent=np.column_stack([np.arange(6), np.arange(1, 7)]),
    )
    distant = np.ascontiguousarray(memory.taps[size:].T)
    return recent, _owned((memory.pairs, distant, np.zeros((6, length - 1)), np.zeros((6, size))))


def _stride(sampling_step: float | None, step: float) -> int:
    """Steps for which eq. (1) holds: those of a sampling step of the sea, where they fit into it."""
    if sampling_step is None:
        return _HARMONIC_STEPS
    ratio = sampling_step / step
    return round(ratio) if ratio > 0.5 and abs(ratio - round(ratio)) < _WHOLE * ratio else 1


def _owned(arrays: tuple[Any, ...]) -> tuple[Any, ...]:
    """Copies, which are writable whatever the models' own are: one compiled form serves them all."""
    return tuple(np.array(array) for array in arrays)


def _wind_arrays(wind: WindLoads | None) -> tuple[Any, ...]:
    if wind is None:
        return _owned((np.zeros((0, 3)), np.zeros((0, 2)), *np.zeros((3, 0)), np.zeros(2), np.zeros(0)))
    return _owned(wind.arrays)


def _wave_arrays(waves: WaveLoads | None) -> tuple[tuple[Any, ...], tuple[Any, ...], float]:
    """Arguments of the kernels of waves and of the splash zone, and the factor on the position."""
    dry = (np.zeros((0, 4), dtype=np.int64), np.zeros((0, 26)), np.zeros((0, 2)), np.zeros(7))
    if waves is None:
        none = linear_rows(np.zeros((_FORCE_ROWS, 0), dtype=np.complex128), calm_water(water_depth=1.0))
        return (_owned(none.arrays), *_owned((np.zeros((0, 8)), np.zeros((0, 6)), np.zeros((7, 6))))), dry, 0.0
    zone = waves._splash
    arrays = _owned(waves._rows.arrays), *_owned((waves._strips, waves._weight, waves._damping))
    splash = dry if zone is None else (zone.rows, zone.table, zone.current, zone.rule)
    return arrays, _owned(splash), float(waves._position_factor)
