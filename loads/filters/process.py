"""Streams of samples of an ARMA model: started in the stationary state, compiled, and exactly repeatable.

    y_n = sum_{k=1..p} A_k y_{n-k} + sum_{l=0..q} B_l w_{n-l},   n = 0, 1 ...                        (1)

What lies before sample 0 is drawn from its exact joint distribution. With the impulse response H_j of the model,

    y_{-i} = sum_{j>=0} H_j w_{-i-j},   i = 1 ... p,   and   w_{-1} ... w_{-q}                       (2)

are linear in the earlier noises. The triangular factor of that map (QR) is a root of their joint covariance, made
without ever forming a covariance, which would lose half of the digits. It turns as many normal numbers into samples,
so that the process is stationary from its first sample on, without burn-in. The noise comes in blocks from a
counter-based generator: sample n is a function of the model, the seed, the stream and n alone, and any state can be
restored, or left, without changing a bit.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.model import ArmaModel, full_impulse_response, recur, transposed
from tlpsim.loads.filters.random_numbers import noise_block

FloatArray = NDArray[np.float64]

_BLOCK = 1024  # samples for which the noise is drawn at once
_CHUNK = 32  # samples that a stream makes ahead at once
_START_BLOCK = (
    0  # the block of noise that the stationary start uses up; sample n has its noise in block 1 + n // _BLOCK
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessState:
    """Snapshot of a stream: what the samples from `index` on are made of.

    Parameters
    ----------
    index
        Number of the first sample that is not yet in `samples`.
    samples
        Retained samples before it, oldest first, shape (L, m).
    noises
        Noises before it, oldest first, shape (q, m).
    """

    index: int
    samples: FloatArray
    noises: FloatArray


def stationary_start(model: ArmaModel, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Samples and noises before sample 0, drawn from eq. (2).

    Parameters
    ----------
    model
        Of orders p and q, with m components.
    noise
        Standard normal numbers, shape (q + p, m).

    Returns
    -------
    Samples, shape (p, m), and noises, shape (q, m), oldest first.

    Raises
    ------
    SolverError
        If the model is not stable.
    """
    p, q = model.orders
    size = model.size
    response = full_impulse_response(model)
    count = len(response)
    # Columns: noises -q ... -1 and samples -p ... -1; rows: the noises -1, -2 ... that they are made of.
    made_of = np.zeros((q + p, size, count, size))
    for j in range(q):
        made_of[j, :, q - 1 - j, :] = np.eye(size)
    for i in range(p):
        age = p - 1 - i
        made_of[q + i, :, age:, :] = response[: count - age].transpose(1, 0, 2)
    triangle = np.asarray(np.linalg.qr(made_of.reshape((q + p) * size, count * size).T, mode="r"))
    drawn = (triangle.T @ noise.ravel()).reshape(q + p, size)
    return drawn[q:], drawn[:q]


def _start(model: ArmaModel, seed: int, stream: int) -> tuple[FloatArray, FloatArray]:
    p, q = model.orders
    return stationary_start(model, noise_block(seed, stream, _START_BLOCK, p + q, model.size))


def generate(model: ArmaModel, seed: int, stream: int, count: int) -> FloatArray:
    """Samples 0 ... count - 1 in one compiled pass, shape (count, m): those that `ArmaProcess` gives one by one.

    Raises
    ------
    SolverError
        If the model is not stable.
    ScenarioError
        If the seed or the stream is out of range.
    """
    p, q = model.orders
    samples = np.empty((p + count, model.size))
    noises = np.empty((q + count, model.size))
    samples[:p], noises[:q] = _start(model, seed, stream)
    for block, first in enumerate(range(0, count, _BLOCK), start=1):
        rows = min(_BLOCK, count - first)
        noises[q + first : q + first + rows] = noise_block(seed, stream, block, rows, model.size)
    recur(transposed(model.autoregressive), transposed(model.moving_average), samples, noises, p, p + count, q - p)
    return samples[p:]


class ArmaProcess:
    """A stream of samples y_0, y_1 ... of eq. (1), each a pure function of (model, seed, stream, index).

    Parameters
    ----------
    model
        A stable model.
    seed, stream
        Key of the noise, see `random_generator`.
    retained
        Largest number of samples that `window` gives at once.

    Raises
    ------
    SolverError
        If the model is not stable.
    ScenarioError
        If the seed or the stream is out of range.
    """

    def __init__(self, model: ArmaModel, seed: int, stream: int, retained: int) -> None:
        p, q = model.orders
        self.model = model
        self._seed, self._stream = seed, stream
        self._autoregressive = transposed(model.autoregressive)
        self._moving_average = transposed(model.moving_average)
        self._retained = retained
        # Rows: samples before the current block, then the block; the same for the noises.
        self._length = max(p, retained)
        self._samples = np.zeros((self._length + _BLOCK, model.size))
        self._noises = np.zeros((q + _BLOCK, model.size))
        self._started = _start(model, seed, stream)
        self._restart()

    def _restart(self) -> None:
        samples, noises = self._started
        self._samples[: self._length] = 0.0
        self._samples[self._length - len(samples) : self._length] = samples
        self._noises[: len(noises)] = noises
        self._origin = 0  # index of the first sample of the block, in row `_length`
        self._made = 0  # samples of the block that are made
        self._draw()

    def _draw(self) -> None:
        block = 1 + self._origin // _BLOCK
        noise = noise_block(self._seed, self._stream, block, _BLOCK, self.model.size)
        self._noises[-_BLOCK:] = noise

    def _next_block(self) -> None:
        self._samples[: self._length] = self._samples[_BLOCK:].copy()
        self._noises[:-_BLOCK] = self._noises[_BLOCK:].copy()
        self._origin += _BLOCK
        self._made = 0
        self._draw()

    def _make(self, last: int) -> None:
        """Make samples up to index `last`."""
        while self._origin + self._made <= last:
            if self._made == _BLOCK:
                self._next_block()
            until = min(_BLOCK, -(-(last + 1 - self._origin) // _CHUNK) * _CHUNK)
            recur(
                self._autoregressive,
                self._moving_average,
                self._samples,
                self._noises,
                self._length + self._made,
                self._length + until,
                len(self._noises) - len(self._samples),
            )
            self._made = until

    def window(self, first: int, count: int) -> FloatArray:
        """Samples first ... first + count - 1, shape (count, m); valid until the next call, do not keep it.

        Going back further than the retained samples replays the stream from its start, with the same values.
        """
        if first < 0 or not 0 < count <= self._retained:
            raise ValueError(f"samples {first} to {first + count - 1} cannot be had from a window of {self._retained}")
        if first < self._origin - self._length:
            self._restart()
        self._make(first + count - 1)
        row = self._length + first - self._origin
        return self._samples[row : row + count]

    def get_state(self) -> ProcessState:
        """Snapshot that `set_state` restores exactly."""
        samples, noises = self._samples[: self._length].copy(), self._noises[:-_BLOCK].copy()
        samples.flags.writeable = False
        noises.flags.writeable = False
        return ProcessState(index=self._origin, samples=samples, noises=noises)

    def set_state(self, state: ProcessState) -> None:
        """Restore a snapshot of this stream (same model and seed), in this or another process.

        Raises
        ------
        ScenarioError
            If the snapshot is of another shape, or its index is not one that `get_state` gives.
        """
        shapes = (self._length, self.model.size), (len(self._noises) - _BLOCK, self.model.size)
        if (state.samples.shape, state.noises.shape) != shapes or state.index < 0 or state.index % _BLOCK:
            raise ScenarioError(
                f"state of a random process has index {state.index} and shapes {state.samples.shape} and "
                f"{state.noises.shape}; they must be a multiple of {_BLOCK}, {shapes[0]} and {shapes[1]}"
            )
        history, past = self._samples[: self._length], self._noises[:-_BLOCK]
        if (
            state.index == self._origin
            and np.array_equal(state.samples, history)
            and np.array_equal(state.noises, past)
        ):
            return  # the samples made since are functions of what is restored
        history[:], past[:] = state.samples, state.noises
        self._origin, self._made = state.index, 0
        self._draw()
