"""Hermite expansion of drag against refined quadrature, its identities and Monte Carlo; its cost.

.venv/bin/python benchmarks/spectral_hermite.py [--quick]
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from report import Row, at_most, main

from tlpsim.loads.spectral.hermite import expand

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "loads" / "spectral"))
from test_hermite import about_the_kink, deviations, one, sampled_products

FloatArray = NDArray[np.float64]

ROUNDS = 20
COSTS = {  # variances in principal axes, mean velocity on each of them relative to a random one
    "two dimensions": ([1.0, 0.5], [1.0, 1.0]),
    "two dimensions, long-crested, no cross current": ([1.0, 0.0], [1.0, 0.0]),
    "three dimensions": ([1.0, 0.5, 0.3], [1.0, 1.0, 1.0]),
    "three dimensions, long-crested, no cross current": ([1.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
}


def states(count: int, rng: np.random.Generator) -> list[tuple[FloatArray, FloatArray]]:
    """Means and variances in two dimensions.

    Variances have ratios down to 1e-12, means are 0 to 1000 spreads on each axis; every fourth variance is zero on one
    axis, with a cross current of 1e-9 to 1000 spreads of the other.
    """
    drawn = []
    for i in range(count):
        variance = np.array([1.0, 10.0 ** rng.uniform(-12.0, 0.0)])
        mean = np.sqrt(variance) * 10.0 ** rng.uniform(-3.0, 3.0, 2) * rng.choice([-1.0, 0.0, 1.0, 1.0], 2)
        if i % 4 == 0:
            variance[1], mean[1] = 0.0, 10.0 ** rng.uniform(-9.0, 3.0)
        drawn.append((mean, variance))
    return drawn


def spatial_states(count: int, rng: np.random.Generator) -> list[tuple[FloatArray, FloatArray]]:
    """Means and variances in three dimensions, every second with a plane of fluctuations that misses the kink."""
    drawn = []
    for i in range(count):
        variance = np.array([1.0, *np.sort(10.0 ** rng.uniform(-1.5, 0.0, 2))[::-1]])
        mean = np.sqrt(variance) * rng.normal(0.0, 1.5, 3)
        if i % 2 == 0:
            variance[2], mean[2] = 0.0, 10.0 ** rng.uniform(-3.0, 1.0)
        drawn.append((mean, variance))
    return drawn


def accuracy(quick: bool) -> list[Row]:
    rng = np.random.default_rng(7)
    rows = []
    for words, drawn in (
        ("two dimensions", states(100 if quick else 1000, rng)),
        ("three dimensions", spatial_states(4 if quick else 20, rng)),
    ):
        errors = np.array(
            [
                deviations(one(mean, np.diag(variance)), about_the_kink(mean, variance), mean, variance)
                for mean, variance in drawn
            ]
        )
        rows += [
            at_most(f"{name} coefficient against quadrature, {words}, {len(drawn)} states", error, 1e-10)
            for name, error in zip(("mean", "linear", "quadratic", "cubic"), errors.max(axis=0), strict=True)
        ]
    return rows


def identities(quick: bool) -> list[Row]:
    """Each coefficient against the derivative of the one before by differences of eighth order."""
    rng = np.random.default_rng(8)
    formula = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
    worst = np.zeros(3)
    for i in range(20 if quick else 200):
        dimension = 1 + i % 3
        factor = rng.normal(0.0, 1.0, (dimension, dimension))
        covariance = factor @ factor.T + 0.3 * np.eye(dimension)
        mean = rng.normal(0.0, 1.5, dimension)
        h = 0.05 * np.sqrt(np.linalg.eigvalsh(covariance)[0])
        here = one(mean, covariance)
        for axis in range(dimension):
            steps = mean + h * np.arange(-4, 5)[:, None] * np.eye(dimension)[axis]
            around = expand(steps, np.tile(covariance, (9, 1, 1)))
            for degree, field in enumerate((around.mean, around.linear, around.quadratic)):
                slope = np.einsum("s,s...->...", formula / h, field) / (degree + 1)
                expected = here[degree + 1]
                error = np.abs(slope - expected[..., axis]).max() / np.abs(expected).max()
                worst[degree] = max(worst[degree], error)
    words = ("C1 = dc0/dU", "C2 = (dC1/dU)/2", "C3 = (dC2/dU)/3")
    return [at_most(f"{word} by differences", error, 1e-8) for word, error in zip(words, worst, strict=True)]


def monte_carlo(quick: bool) -> list[Row]:
    count = 1_000_000 if quick else 8_000_000
    products = sampled_products(count, 21)
    scores = [float((np.abs(sampled - expected) / error).max()) for expected, sampled, error in products]
    errors = [float((error / np.abs(expected).max()).max()) for expected, _, error in products]
    return [
        at_most(
            f"{words}, {count:.0e} samples, errors to {100 * max(errors[part]):.2g} %",
            max(scores[part]),
            4.0,
            "s.e.",
        )
        for words, part in (("drag by Monte Carlo", slice(0, 4)), ("splash by Monte Carlo", slice(4, None)))
    ]


def cost(quick: bool) -> list[Row]:
    rows = []
    rng = np.random.default_rng(9)
    for words, (variance, current) in COSTS.items():
        mean = rng.normal(0.0, 1.0, (100, len(variance))) * current
        covariance = np.tile(np.diag(variance), (100, 1, 1))
        seconds = []
        for _ in range(ROUNDS):
            began = time.perf_counter()
            expand(mean, covariance)
            seconds.append(time.perf_counter() - began)
        rows.append(Row(item=f"100 elements, {words}", measured=f"{1e3 * np.median(seconds):.2g} ms"))
    return rows


def hermite(quick: bool) -> list[Row]:
    return [*accuracy(quick), *identities(quick), *monte_carlo(quick), *cost(quick)]


if __name__ == "__main__":
    main("Hermite expansion of drag", [hermite])
