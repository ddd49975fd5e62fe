"""From the spectra of position to those of everything that is asked for.

    y = c x + q + s eta                                                                                 (1)
    S_y = (2 pi f)^(2 p) [c, 1] S [c, 1]^H                                                              (2)

c are the exact derivatives at the mean position, q a quadratic function 1/2 T'' : x x whose spectrum stands beside
that of the position (tensions), s = -1 for the air gap, and p = 1 for velocities, 2 for accelerations. Points of the
platform and the air gap are linear in the position, their means those of the mean position: setdown is in heave. The
air gap is that above the elevation at the reference point, as the platform's FMU has it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.platform.body import rotation_matrix
from tlpsim.loads.platform.tendons import tendon_loads
from tlpsim.loads.spectral.dynamics import Dynamics, jacobian, tension_expansion
from tlpsim.loads.spectral.iteration import State
from tlpsim.loads.spectral.model import SpectralModel
from tlpsim.loads.spectral.records import Quantity

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_SAME = 1e-6  # relative difference of the derivatives of tendons that are alike


@dataclass(frozen=True, slots=True, kw_only=True)
class Outputs:
    """What is asked for beside the position.

    Attributes
    ----------
    tensions, bottom_less_top
        At the mean position, (t,) N, and the bottoms' less the tops'.
    gradients
        T', (t, 6).
    curvatures
        T'' of tendons that differ, (q, 6, 6).
    kind, first
        Number of each tendon among those that differ, (t,), and the first tendon of each number, (q,).
    places, place_gradients
        Of points at the mean position, (n, 3) m, and their derivatives (n, 3, 6).
    """

    tensions: FloatArray
    bottom_less_top: FloatArray
    gradients: FloatArray
    curvatures: FloatArray
    kind: NDArray[np.int64]
    first: NDArray[np.int64]
    places: FloatArray
    place_gradients: FloatArray

    @property
    def forms(self) -> tuple[FloatArray, FloatArray]:
        """First (6 + q, 6) and second derivatives (6 + q, 6, 6) of the position and of tensions that differ."""
        return (
            np.concatenate([np.eye(6), self.gradients[self.first]]),
            np.concatenate([np.zeros((6, 6, 6)), self.curvatures]),
        )


def outputs(model: SpectralModel, pose: FloatArray) -> Outputs:
    """What is asked for, expanded about a mean position."""
    tensions, gradients, curvatures = tension_expansion(model.platform, pose)
    bottoms = tendon_loads(model.platform.tendons, pose)[2]
    derivatives = np.concatenate([gradients, curvatures.reshape(-1, 36)], axis=1)
    scale = np.abs(derivatives).max(axis=0, initial=0.0)
    rounded = np.round(derivatives / np.where(scale > 0.0, scale, 1.0) / _SAME)
    _, chosen, kind = np.unique(rounded, axis=0, return_index=True, return_inverse=True)

    def places(at: NDArray[Any]) -> NDArray[Any]:
        return at[:3] + model.points @ rotation_matrix(at[3:]).T

    return Outputs(
        tensions=tensions,
        bottom_less_top=bottoms - tensions,
        gradients=gradients,
        curvatures=curvatures[chosen],
        kind=kind.ravel(),
        first=chosen,
        places=places(pose),
        place_gradients=jacobian(places, pose),
    )


def quantities(
    asked: Outputs,
    model: SpectralModel,
    system: Dynamics,
    frequency: FloatArray,
    spectrum: ComplexArray,
    state: State,
    sea: tuple[ComplexArray, ComplexArray],
    cumulants: FloatArray,
) -> dict[str, Quantity]:
    """Every quantity by name.

    Parameters
    ----------
    spectrum
        Of the position and of the quadratic quantities 1/2 T'' : x x, (m, 6 + q, 6 + q).
    state
        For the covariance of the position.
    sea
        First-order motion (6, m, r) and elevation (m, r).
    cumulants
        Third and fourth, (6 + q, 2), of the position and of tensions that differ.
    """
    numbers = np.arange(1, len(asked.tensions) + 1) if model.tendons is None else model.tendons
    rows = _rows(asked)
    powers = _powers(spectrum, rows)
    rates = (2.0 * np.pi * frequency) ** 2
    found: dict[str, Quantity] = {}

    def add(name: str, unit: str, mean: float, row: int, power: int = 0, higher: Any = (0.0, 0.0)) -> None:
        density = powers[row] * rates**power if power else powers[row]
        variance = float(np.trapezoid(density, frequency))
        shape = (higher[0] / variance**1.5, higher[1] / variance**2) if variance > 0.0 else (0.0, 0.0)
        found[name] = Quantity(
            name=name,
            unit=unit,
            mean=mean,
            frequency=frequency,
            density=density,
            skewness=float(shape[0]),
            excess_kurtosis=float(shape[1]),
        )

    for power, (prefix, per) in enumerate((("position", ""), ("velocity", "/s"), ("acceleration", "/s2"))):
        for i, degree in enumerate(DEGREES_OF_FREEDOM):
            unit = ("m" if i < 3 else "rad") + per
            mean = 0.0 if power else float(system.pose[i])
            add(f"{prefix}.{degree}", unit, mean, i, power, (0.0, 0.0) if power else cumulants[i])
    for prefix, change in (
        ("tendon_tension", np.zeros(len(numbers))),
        ("tendon_bottom_tension", asked.bottom_less_top),
    ):
        for t, number in enumerate(numbers):
            curve = asked.curvatures[asked.kind[t]]
            mean = asked.tensions[t] + change[t] + 0.5 * float(np.sum(curve * state.position))
            add(f"{prefix}[{number}]", "N", float(mean), 6 + t, 0, cumulants[6 + asked.kind[t]])
    for k, place in enumerate(asked.places):
        for axis, name in enumerate("xyz"):
            row = 6 + len(numbers) + 3 * k + axis
            add(f"point_position[{k + 1}].{name}", "m", float(place[axis]), row)
            add(f"point_acceleration[{k + 1}].{name}", "m/s2", 0.0, row, 2)
    if len(asked.places):
        waves, elevation = sea
        rise = np.tensordot(asked.place_gradients[0, 2], waves, axes=1)
        change = np.sum(np.abs(rise - elevation) ** 2 - np.abs(rise) ** 2, axis=1)
        own = found["point_position[1].z"].density + change
        found["airgap"] = Quantity(
            name="airgap", unit="m", mean=float(asked.places[0, 2]), frequency=frequency, density=np.maximum(own, 0.0)
        )
    return found


def _rows(asked: Outputs) -> FloatArray:
    """[c, 1] of eq. (2) of positions, tensions and points, (6 + t + 3 n, 6 + q)."""
    size = len(asked.curvatures)
    tensions = np.concatenate([asked.gradients, np.eye(size)[asked.kind]], axis=1)
    linear = [np.eye(6), asked.place_gradients.reshape(-1, 6)]
    positions, places = (np.concatenate([each, np.zeros((len(each), size))], axis=1) for each in linear)
    return np.concatenate([positions, tensions, places])


def _powers(spectrum: ComplexArray, rows: FloatArray) -> FloatArray:
    """Spectra (n, m) of rows (n, k) by cross-spectra (m, k, k), none below zero."""
    squares = (rows[:, :, None] * rows[:, None, :]).reshape(len(rows), -1)
    return np.maximum(squares @ spectrum.real.reshape(len(spectrum), -1).T, 0.0)
