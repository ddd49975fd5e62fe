"""Quantities beside the position, from made-up spectra of it, against samples of the exact functions."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tlpsim.loads import issc_tlp
from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.platform.body import rotation_matrix
from tlpsim.loads.platform.motion import PlatformModel, remaining
from tlpsim.loads.platform.tendons import tendon_loads
from tlpsim.loads.spectral.dynamics import dynamics
from tlpsim.loads.spectral.iteration import State
from tlpsim.loads.spectral.model import SpectralModel
from tlpsim.loads.spectral.outputs import Outputs, outputs, quantities
from tlpsim.loads.spectral.quadratic_forms import product_spectrum
from tlpsim.loads.spectral.records import Quantity, band_integral

POSE = np.array([8.0, -3.0, -0.11, 1e-4, -2e-4, 0.03])
SIZE = np.array([2.0, 1.0, 0.02, 1e-4, 1e-4, 0.01])
FREQUENCY = 1e-3 * np.arange(101)
POINTS = np.array([[10.0, -20.0, 25.0], [40.0, 40.0, -35.0]])


def model(platform: PlatformModel, tendons: NDArray[np.int64] | None = None) -> SpectralModel:
    return SpectralModel(platform=platform, points=POINTS, tendons=tendons)


def spectrum() -> NDArray[np.complex128]:
    """Cross-spectra of a position whose degrees of freedom go together, (101, 6, 6)."""
    rng = np.random.default_rng(6)
    rows = (rng.normal(size=(101, 6, 4)) + 1j * rng.normal(size=(101, 6, 4))) * SIZE[:, None] * np.sqrt(1.0 / 0.8)
    rows *= np.exp(-FREQUENCY / 0.03)[:, None, None]
    rows[0] = rows[0].real
    return np.asarray(rows @ rows.conj().swapaxes(1, 2))


def found(given: SpectralModel) -> tuple[Outputs, dict[str, Quantity], NDArray[np.float64]]:
    """What is asked for, the quantities, and the covariance of the position."""
    asked, own = outputs(given, POSE), spectrum()
    covariance = np.trapezoid(own.real, FREQUENCY, axis=0)
    count = 6 + len(asked.curvatures)
    whole = np.zeros((len(FREQUENCY), count, count), dtype=np.complex128)
    whole[:, :6, :6] = own
    # Twice the length, so that nothing of the squares is cut off.
    longer = np.concatenate([own, np.zeros_like(own)])
    squares = product_spectrum(1e-3 * np.arange(len(longer)), longer, 0.5 * asked.curvatures)
    frequency = 1e-3 * np.arange(len(longer))
    whole = np.concatenate([whole, np.zeros_like(whole)])
    whole[:, 6:, 6:] = squares
    none = np.zeros((6, 6))
    state = State(
        pose=POSE,
        strips=np.zeros((0, 2, 2)),
        pieces=np.zeros((0, 2, 2)),
        cross=np.zeros((0, 2)),
        relative=np.zeros(0),
        velocity=none,
        position=covariance,
        second_velocity=none,
        second_position=none,
        second_load=np.zeros(6),
        group_load=np.zeros(6),
        group_damping=none,
    )
    system = dynamics(given.platform, POSE, np.zeros(6), np.zeros(6), none, none)
    waves = 0.01 * np.ones((6, len(frequency), 2)) * SIZE[:, None, None] * (1.0 + 1j)
    elevation = np.stack([0.3 + 0.0 * frequency, 0.1j + 0.0 * frequency], axis=1)
    higher = np.zeros((count, 2))
    higher[2], higher[6] = (1e-6, 3e-8), (1e15, 1e21)
    named = quantities(asked, given, system, frequency, whole, state, (waves, elevation), higher)
    return asked, named, covariance


def test_names_and_units_are_those_of_the_platform() -> None:
    _, named, _ = found(model(issc_tlp.platform()))
    names = [f"{kind}.{each}" for kind in ("position", "velocity", "acceleration") for each in DEGREES_OF_FREEDOM]
    names += [f"{kind}[{k}]" for kind in ("tendon_tension", "tendon_bottom_tension") for k in range(1, 13)]
    names += [f"point_{kind}[{k}].{axis}" for k in (1, 2) for axis in "xyz" for kind in ("position", "acceleration")]
    assert set(named) == {*names, "airgap"}
    assert list(named)[:6] == names[:6]
    assert all(name == each.name for name, each in named.items())
    assert named["velocity.yaw"].unit == "rad/s"
    assert named["acceleration.heave"].unit == "m/s2"
    assert named["tendon_bottom_tension[12]"].unit == "N"


def test_rates_have_the_spectra_of_derivatives() -> None:
    _, named, covariance = found(model(issc_tlp.platform()))
    for i, name in enumerate(DEGREES_OF_FREEDOM):
        position, velocity, acceleration = (named[f"{k}.{name}"] for k in ("position", "velocity", "acceleration"))
        omega = 2.0 * np.pi * position.frequency
        np.testing.assert_allclose(velocity.density, omega**2 * position.density, rtol=1e-12)
        np.testing.assert_allclose(acceleration.density, omega**4 * position.density, rtol=1e-12)
        # The band's end is cut off in the one and slopes to zero in the other.
        assert position.spread() == pytest.approx(np.sqrt(covariance[i, i]), rel=1e-4)
        assert (position.mean, velocity.mean, acceleration.mean) == (POSE[i], 0.0, 0.0)


def test_tensions_and_points_against_samples() -> None:
    """15 000 normal positions about the mean one, through the exact tensions and places."""
    given = model(issc_tlp.platform())
    _, named, covariance = found(given)
    draws = POSE + np.random.default_rng(9).multivariate_normal(np.zeros(6), covariance, size=15000)
    tops, bottoms = np.empty((len(draws), 12)), np.empty((len(draws), 12))
    places = np.empty((len(draws), 2, 3))
    for n, pose in enumerate(draws):
        _, tops[n], bottoms[n] = tendon_loads(given.platform.tendons, pose)
        places[n] = pose[:3] + POINTS @ rotation_matrix(pose[3:]).T
    assert tops.min() > 0.0
    for k in range(12):
        for name, samples in (("tendon_tension", tops[:, k]), ("tendon_bottom_tension", bottoms[:, k])):
            quantity = named[f"{name}[{k + 1}]"]
            # Four standard errors of the mean are 0.033 of the spread, and three of the spread 0.018 of it.
            assert quantity.mean == pytest.approx(samples.mean(), abs=0.035 * samples.std())
            assert quantity.spread() == pytest.approx(samples.std(), rel=0.02)
    for k in range(2):
        for i, axis in enumerate("xyz"):
            quantity, samples = named[f"point_position[{k + 1}].{axis}"], places[:, k, i]
            # A turn by yaw moves a point by its second order, 0.01² / 2 of 60 m, which is left out.
            assert quantity.mean == pytest.approx(samples.mean(), abs=0.035 * samples.std() + 0.005)
            assert quantity.spread() == pytest.approx(samples.std(), rel=0.02)
            acceleration = named[f"point_acceleration[{k + 1}].{axis}"].density
            np.testing.assert_allclose(acceleration, (2.0 * np.pi * quantity.frequency) ** 4 * quantity.density)


def test_equal_tendons_share_a_curvature_and_a_shape() -> None:
    asked, named, _ = found(model(issc_tlp.platform()))
    assert len(asked.curvatures) == 4
    assert [int(k) for k in asked.kind] == [int(k) for k in np.repeat(asked.kind[::3], 3)]
    rows, forms = asked.forms
    assert (rows.shape, forms.shape) == ((10, 6), (10, 6, 6))
    assert not forms[:6].any()
    first = [k for k in range(12) if asked.kind[k] == 0]
    for k in range(12):
        quantity = named[f"tendon_tension[{k + 1}]"]
        variance = band_integral(quantity.frequency, quantity.density)
        expected = (1e15 / variance**1.5, 1e21 / variance**2) if k in first else (0.0, 0.0)
        assert (quantity.skewness, quantity.excess_kurtosis) == pytest.approx(expected)
    heave = named["position.heave"]
    assert heave.skewness == pytest.approx(1e-6 / heave.spread() ** 3)
    assert heave.excess_kurtosis == pytest.approx(3e-8 / heave.spread() ** 4)
    assert named["velocity.heave"].skewness == 0.0


def test_a_lost_tendon_keeps_the_numbers_of_the_others() -> None:
    whole = issc_tlp.platform()
    intact = np.arange(12) != 3
    lost = remaining(whole, intact)
    asked, named, _ = found(model(lost, np.flatnonzero(intact) + 1))
    tensions = [name for name in named if name.startswith("tendon_tension")]
    assert tensions == [f"tendon_tension[{k}]" for k in range(1, 13) if k != 4]
    exact = tendon_loads(whole.tendons, POSE)[1]
    np.testing.assert_allclose(asked.tensions, exact[intact], rtol=1e-9)
    same = found(model(whole))[1]["tendon_tension[5]"]
    assert named["tendon_tension[5]"].mean == pytest.approx(same.mean, rel=1e-9)
    assert named["tendon_tension[5]"].spread() == pytest.approx(same.spread(), rel=1e-6)


def test_air_gap_is_the_point_above_the_water() -> None:
    """With first-order motion of two sources, beside the rest of the motion that has none of their phase."""
    given = model(issc_tlp.platform())
    asked, named, _ = found(given)
    rise = asked.place_gradients[0, 2] @ (0.01 * SIZE * (1.0 + 1j))
    change = np.abs(rise - 0.3) ** 2 + np.abs(rise - 0.1j) ** 2 - 2.0 * np.abs(rise) ** 2
    point = named["point_position[1].z"]
    assert np.all(change > 0.0)
    np.testing.assert_allclose(named["airgap"].density, point.density + change, rtol=1e-9)
    assert named["airgap"].mean == point.mean
    none = replace(given, points=np.zeros((0, 3)))
    assert not [name for name in found(none)[1] if name.startswith(("point", "airgap"))]


def test_integral_over_a_band_ends_between_frequencies() -> None:
    frequency = np.linspace(0.0, 1.0, 11)
    assert band_integral(frequency, 2.0 * frequency, 0.25, 0.75) == pytest.approx(0.5)
    assert band_integral(frequency, 2.0 * frequency) == pytest.approx(1.0)
    assert band_integral(frequency, 2.0 * frequency, 0.31, 0.34) == pytest.approx(0.34**2 - 0.31**2)
    assert band_integral(frequency, 2.0 * frequency, 2.0, 3.0) == 0.0
    # Ends that fall between, where the density is linear.
    parts = [band_integral(frequency, frequency**2, a, b) for a, b in ((0.0, 0.123), (0.123, 0.5), (0.5, 1.0))]
    assert sum(parts) == pytest.approx(band_integral(frequency, frequency**2))
