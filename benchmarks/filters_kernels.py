"""Convolution kernels, interpolation filters, central differences and their hybrid: measured errors.

python benchmarks/filters_kernels.py [--quick]
"""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import product

import numpy as np
from numpy.typing import NDArray
from report import Row, at_most, main

from tlpsim.loads.filters.convolution import (
    ToeplitzKernels,
    best_reach,
    floored,
    fraction_of_step,
    kernel,
    kernel_error,
    kernel_response,
    quadrature,
)
from tlpsim.loads.filters.differentiation import CENTRAL_DIFFERENCES, derivative_gain
from tlpsim.loads.filters.hybrid import derivative_response
from tlpsim.loads.filters.interpolation import SYMMETRIC, report
from tlpsim.loads.waves.airy import velocity_transfer, wavenumber
from tlpsim.loads.waves.spectra import jonswap, pierson_moskowitz

STEP = 0.5
REACH = 40  # taps to either side: ± 20 s
FREQUENCY = np.linspace(0.0, 0.5 / STEP, 1025)
OMEGA = 2.0 * np.pi * FREQUENCY
REFERENCE = jonswap(FREQUENCY, 12.0, 14.0, 3.3)
SEAS = {
    "JONSWAP Hs 12 m Tp 14 s": REFERENCE,
    "JONSWAP 18 s": jonswap(FREQUENCY, 15.0, 18.0, 2.0),
    "PM 14.5 s": pierson_moskowitz(FREQUENCY, 7.08, 14.52),
    "JONSWAP 10 s": jonswap(FREQUENCY, 6.0, 10.0, 5.0),
    "PM 8 s": pierson_moskowitz(FREQUENCY, 3.0, 8.0),
    "JONSWAP 6 s": jonswap(FREQUENCY, 2.0, 6.0, 3.3),
}
DEPTHS = (np.inf, 450.0, 60.0)
ALONG = (-43.0, -20.0, 0.0, 43.0)
BELOW = (-15.0, -25.0, -35.0)

Array = NDArray[np.complex128]


def water(x: float, z: float, depth: float) -> tuple[Array, Array]:
    """Velocity and acceleration (horizontal, vertical) for a unit amplitude, each of shape (nf, 2)."""
    wave = wavenumber(OMEGA[1:], depth)
    velocity = velocity_transfer(OMEGA[1:], wave, 0.0, depth, np.array([[x, 0.0, z]]))[0, [0, 2]].T
    velocity = np.vstack([velocity[:1], velocity])
    return velocity, 1j * OMEGA[:, np.newaxis] * velocity


def worst(transfers: list[Array], density: NDArray[np.float64]) -> float:
    """Largest error of symmetric kernels of ± 20 s."""
    fitted = ToeplitzKernels(floored(density), FREQUENCY, STEP, REACH, REACH)
    rows = np.hstack(transfers)
    return float(kernel_error(fitted.kernels(rows), rows, FREQUENCY, density, STEP, REACH).max())


def kernels(quick: bool) -> list[Row]:
    velocity, acceleration = water(43.0, -15.0, np.inf)
    rows = [
        at_most("kernel ± 20 s, z = -15 m, x = +43 m, deep: velocity, rms", worst([velocity], REFERENCE), 5e-4),
        at_most("the same: acceleration, rms", worst([acceleration], REFERENCE), 5e-4),
    ]
    seas = dict(list(SEAS.items())[:: 3 if quick else 1])
    places = list(product(ALONG, BELOW, DEPTHS))
    for advance in (0.0, 0.4):
        phase = fraction_of_step(FREQUENCY, STEP, advance)[:, np.newaxis]
        waters = [water(*place) for place in places]
        errors = {name: worst([phase * v for v, _ in waters], density) for name, density in seas.items()}
        name = max(errors, key=errors.__getitem__)
        item = (
            f"velocity, {len(places)} places in 3 depths x {len(seas)} seas, {advance:g} of a step on: worst ({name})"
        )
        rows.append(at_most(item, errors[name], 5e-4))
    errors = {name: worst([a for _, a in waters], density) for name, density in seas.items()}
    name = max(errors, key=errors.__getitem__)
    rows.append(Row(item=f"acceleration in the same: worst ({name})", measured=f"{errors[name]:.3g}"))
    for seconds, chosen in ((40.0, places[::4]), (60.0, [(73.0, -20.0, 450.0), (90.0, -15.0, 450.0)])):
        largest = max(abs(place[0]) for place in chosen)
        item = f"velocity and acceleration, {seconds:g} s laid about the delay, |x| to {largest:g} m: worst"
        found = max(laid(density, place, seconds) for density in seas.values() for place in chosen)
        rows.append(at_most(item, found, 5e-4))
    return [*rows, *refused_kernels(), *closed_form(), *cost(quick)]


def laid(density: NDArray[np.float64], place: tuple[float, float, float], seconds: float) -> float:
    """Largest error of kernels of so many seconds in all, laid where they serve best."""
    transfer = np.hstack(water(*place))
    before, after = best_reach(transfer, FREQUENCY, floored(density), STEP, round(seconds / STEP) + 1)
    found = kernel(transfer, FREQUENCY, floored(density), STEP, before, after)
    return float(kernel_error(found, transfer, FREQUENCY, density, STEP, before).max())


def refused_kernels() -> list[Row]:
    """What least squares is chosen over, and what no kernel of this length can do."""
    velocity, _ = water(43.0, -15.0, np.inf)
    flat = np.ones_like(FREQUENCY)
    series = kernel(velocity, FREQUENCY, flat, STEP, REACH, REACH)
    hann = 0.5 + 0.5 * np.cos(np.pi * np.arange(-REACH, REACH + 1) / (REACH + 1))
    surface, _ = water(43.0, 0.0, np.inf)
    cases = {
        "Fourier series cut at ± 20 s, horizontal velocity": (series, velocity),
        "the same under a Hann window": (series * hann, velocity),
        "least squares at the surface (z = 0)": (kernel(surface, FREQUENCY, floored(REFERENCE), STEP, 40, 40), surface),
    }
    return [
        Row(item=item, measured=f"{kernel_error(h[:1], t[:, :1], FREQUENCY, REFERENCE, STEP, REACH)[0]:.2g}")
        for item, (h, t) in cases.items()
    ]


def closed_form() -> list[Row]:
    """H = |omega| with a flat weight has the Fourier coefficients of a triangle."""
    found = kernel(OMEGA, FREQUENCY, np.ones_like(OMEGA), STEP, 20, 20)[0]
    lags = np.arange(1, 21)
    side = ((-1.0) ** lags - 1.0) / (np.pi * lags**2 * STEP)
    exact = np.concatenate([side[::-1], [np.pi / (2.0 * STEP)], side])
    return [
        at_most("closed form H = |ω|, largest difference of a weight", float(np.abs(found - exact).max()), 1e-5, "1/s")
    ]


def cost(quick: bool) -> list[Row]:
    transfer = np.hstack([part for x in ALONG for z in BELOW for part in water(x, z, np.inf)])
    transfer = np.tile(transfer, (1, 3))
    fitted, began = [], time.perf_counter()
    for _ in range(3 if quick else 10):
        fitted.append(ToeplitzKernels(floored(REFERENCE), FREQUENCY, STEP, REACH, REACH))
    setup = (time.perf_counter() - began) / len(fitted)
    began = time.perf_counter()
    for one in fitted:
        one.kernels(transfer)
    each = (time.perf_counter() - began) / len(fitted) / transfer.shape[1]
    return [
        Row(
            item="time to factorize 81 taps; for each further transfer function",
            measured=f"{1e3 * setup:.0f} ms; {1e6 * each:.0f} µs",
        )
    ]


def interpolation(quick: bool) -> list[Row]:
    rows = []
    band = (0.05, 0.2)
    for step, ratio, error, image in ((0.5, 5, 2e-5, -90.0), (1.0, 10, 5e-5, -85.0)):
        for name in ("linear", "cubic", "six_point", "quintic", "kaiser", "optimal"):
            found = report(SYMMETRIC[name], band, step, ratio)
            bounded = name in ("kaiser", "optimal")
            rows.append(
                Row(
                    item=f"{name}, {step:g} -> 0.1 s, 0.05-0.2 Hz: pass band, image, latency, taps",
                    measured=(
                        f"{found.pass_band_error:.1e}, {found.worst_image:.0f} dB, {found.latency:g} s, {found.taps}"
                    ),
                    bound=f"≤ {error:g}, ≤ {image:g} dB" if bounded else "",
                    ok=found.pass_band_error <= error and found.worst_image <= image if bounded else None,
                )
            )
    return rows


def differentiation(quick: bool) -> list[Row]:
    return [
        Row(
            item=f"central difference of order {order} at 0.2 Hz, step 0.1, 0.5, 1 s: error of the amplitude",
            measured=", ".join(f"{1.0 - derivative_gain(0.2, step, order):.2g}" for step in (0.1, 0.5, 1.0)),
        )
        for order in CENTRAL_DIFFERENCES
    ]


def hybrid(quick: bool) -> list[Row]:
    """Acceleration by velocity kernel, interpolation 0.5 -> 0.1 s and central difference, over the spectrum."""
    ratio = 5
    velocity, acceleration = water(43.0, -15.0, np.inf)
    fitted = ToeplitzKernels(floored(REFERENCE), FREQUENCY, STEP, REACH, REACH)
    response = kernel_response(fitted.kernels(velocity), FREQUENCY, STEP, REACH)
    phases = [fraction_of_step(FREQUENCY, STEP, j / ratio)[:, np.newaxis] for j in range(ratio)]
    exact = np.array([acceleration * phase for phase in phases])
    direct = np.array(
        [kernel_response(fitted.kernels(acceleration * phase), FREQUENCY, STEP, REACH) for phase in phases]
    )
    measure = REFERENCE * quadrature(FREQUENCY)

    def difference(found: Array, wanted: Array) -> float:
        """Largest of horizontal and vertical, relative to the exact acceleration."""
        power = np.einsum("f,jfr->r", measure, np.abs(found - wanted) ** 2)
        return float(np.sqrt(power / np.einsum("f,jfr->r", measure, np.abs(exact) ** 2)).max())

    rows = [
        Row(
            item="acceleration by kernels of its own, every 0.1 s: rms error",
            measured=f"{difference(direct, exact):.1e}",
        )
    ]
    for name, order in (("optimal", 6), ("optimal", 4), ("kaiser", 6), ("quintic", 6), ("optimal", 2), ("linear", 2)):
        slopes = derivative_response(SYMMETRIC[name], FREQUENCY, STEP, ratio, order)
        found = slopes[:, :, np.newaxis] * response
        rows.append(
            Row(
                item=f"hybrid, {name}, difference of order {order}: rms error; from the direct kernels",
                measured=f"{difference(found, exact):.1e}; {difference(found, direct):.1e}",
            )
        )
    return rows


PARTS: list[Callable[[bool], list[Row]]] = [kernels, interpolation, differentiation, hybrid]

if __name__ == "__main__":
    main("Digital filters: kernels", PARTS)
