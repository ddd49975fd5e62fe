"""Sea states of a scatter diagram, and which rows of a table are of which: what is missing is told."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.scenarios.results import ResultsError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

YEAR = 365.25 * 86400.0
"""s"""
LEAST_SHARE = 1e-4
"""of a sea state that is told among those that contribute"""
LARGEST_SHARE_ALONE = 0.01
"""of sea states with one record only, for an interval"""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SeaStates:
    """Sea states of a scatter diagram.

    Attributes
    ----------
    names
        (n,) such as "Hs 14-15 m, Tp 15-16 s".
    probability
        (n,) of each; their sum is 1, or less where the diagram has sea states that are not among them.
    duration
        That each lasts, s.

    Raises
    ------
    ResultsError
        When there are none, their numbers differ, a probability is negative or not finite, or the sum is 0 or above 1.
    """

    names: tuple[str, ...]
    probability: FloatArray
    duration: float = 10800.0

    def __post_init__(self) -> None:
        probability = np.array(self.probability, dtype=np.float64)
        if probability.shape != (len(self.names),) or not len(self.names):
            raise ResultsError(
                f"sea states: {len(self.names)} names and probabilities of the shape {probability.shape}; "
                "give one probability each"
            )
        wrong = np.flatnonzero(~(np.isfinite(probability) & (probability >= 0.0)))
        if len(wrong):
            raise ResultsError(
                f"sea states: the probability of {self.names[wrong[0]]} is {probability[wrong[0]]}; "
                "it must be finite and at least 0"
            )
        total = float(np.sum(probability))
        if not 0.0 < total <= 1.0 + 1e-6:
            raise ResultsError(
                f"sea states: the sum of their probabilities is {total:g}; it must be above 0 and at most 1: "
                "divide occurrences by their number"
            )
        if not (math.isfinite(self.duration) and self.duration > 0.0):
            raise ResultsError(f"sea states: the duration of each is {self.duration} s; it must be above 0")
        probability.flags.writeable = False
        object.__setattr__(self, "probability", probability)


@dataclass(frozen=True, slots=True, kw_only=True)
class Contribution:
    """Share of a sea state, by its number and name, in what passes a level or in damage; all shares sum to 1."""

    state: int
    name: str
    share: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rows:
    """Rows that have an answer, by sea state, and the probabilities that stand for them.

    Attributes
    ----------
    chosen, state
        (a,) numbers of the rows in the order of their sea states, and the sea state of each; those of probability 0
        are left out.
    weight
        (n,) probabilities, renormalised or not; 0 where there is no answer.
    replicates
        (n,) number of rows with an answer.
    covered, without_answer, notes
        As of `LongTermExtreme`.
    """

    chosen: IntArray
    state: IntArray
    weight: FloatArray
    replicates: IntArray
    covered: float
    without_answer: tuple[str, ...]
    notes: tuple[str, ...]


def assign_rows(
    states: SeaStates, known: NDArray[np.bool_], state: ArrayLike | None, signal: str, renormalise: bool
) -> Rows:
    """Rows to sea states; what is missing is told in notes.

    Raises
    ------
    ResultsError
        When the rows do not fit the sea states, or none has an answer.
    """
    count = len(states.names)
    owner = np.arange(count) if state is None else np.asarray(state)
    if owner.shape != known.shape or (len(owner) and not np.issubdtype(owner.dtype, np.integer)):
        raise ResultsError(
            f"{signal}: {len(known)} rows and {owner.size} numbers of their sea states; give one whole number a row"
        )
    if len(owner) and not (owner.min() >= 0 and owner.max() < count):
        raise ResultsError(f"{signal}: sea states are {owner.min()} to {owner.max()}; they must be 0 to {count - 1}")
    chosen = np.flatnonzero(known & (states.probability[owner] > 0.0))
    chosen = chosen[np.argsort(owner[chosen], kind="stable")]
    replicates = np.bincount(owner[chosen], minlength=count)
    answered = replicates > 0
    covered = float(np.sum(states.probability[answered]))
    if covered <= 0.0:
        raise ResultsError(f"{signal}: no sea state has an answer; run its cases")
    silent = np.flatnonzero(~answered & (states.probability > 0.0))
    without = tuple(states.names[k] for k in silent)
    given = float(np.sum(states.probability))
    notes = []
    if given - covered > 1e-6:
        named = f"{', '.join(without[:3])}{', ...' if len(without) > 3 else ''}"
        notes.append(
            f"{len(without)} of {count} sea states, of the probability {given - covered:.3g}, have no answer: {named}"
        )
    if 1.0 - given > 1e-6:
        notes.append(f"sea states of the probability {1.0 - given:.3g} are not among those given")
    if notes:
        stand = (
            "those with an answer stand for the others in proportion" if renormalise else "the others count for nothing"
        )
        notes.append(stand)
    lost = int(np.sum(~known))
    if lost:
        notes.append(f"{lost} of {len(known)} rows have no answer")
    weight = np.where(answered, states.probability, 0.0) / (covered if renormalise else 1.0)
    return Rows(
        chosen=chosen,
        state=owner[chosen].astype(np.int64),
        weight=weight,
        replicates=replicates,
        covered=covered,
        without_answer=without,
        notes=tuple(notes),
    )


def contributions(states: SeaStates, share: FloatArray) -> tuple[Contribution, ...]:
    """Shares (n,) of sea states, largest first, those of `LEAST_SHARE` and more."""
    order = np.argsort(-share, kind="stable")
    return tuple(
        Contribution(state=int(k), name=states.names[k], share=float(share[k]))
        for k in order
        if share[k] >= LEAST_SHARE
    )
