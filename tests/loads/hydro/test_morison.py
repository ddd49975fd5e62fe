import numpy as np
import pytest
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro.morison import Members, added_mass, divide, drag_force, inertia_transfer
from tlpsim.loads.waves.airy import pressure_head_transfer, velocity_transfer
from tlpsim.loads.waves.field import WaveComponents, regular_wave

FloatArray = NDArray[np.float64]

DENSITY, GRAVITY = 1025.0, 9.80665
DIAMETER, DRAUGHT = 10.0, 30.0
SECTION = np.pi * DIAMETER**2 / 4


def member(**changes: object) -> Members:
    """A vertical surface-piercing cylinder on the z axis, or what the changes make of it."""
    parameters: dict[str, object] = {
        "start": [[0.0, 0.0, -DRAUGHT]],
        "end": [[0.0, 0.0, 0.0]],
        "across": [[1.0, 0.0, 0.0]],
        "width": [[DIAMETER, DIAMETER]],
        "area": [SECTION],
        "drag_coefficient": [[0.8, 0.8]],
        "added_mass_coefficient": [[0.9, 0.9]],
        "end_pressure": [[1.0, 0.0]],
        "end_added_mass_coefficient": [[0.0, 0.0]],
    }
    return Members(**(parameters | changes))  # type: ignore[arg-type]


def wave(period: float, heading: float = 0.0, depth: float = np.inf) -> WaveComponents:
    return regular_wave(amplitude=1.0, period=period, heading=heading, water_depth=depth)


@pytest.mark.parametrize("period", [5.0, 9.0, 16.0])
def test_inertia_force_on_a_vertical_cylinder_in_deep_water(period: float) -> None:
    force = inertia_transfer(member(), wave(period), DENSITY)[:, 0]
    omega = 2 * np.pi / period
    k = omega**2 / GRAVITY
    mass = DENSITY * 1.9 * SECTION
    # Integrals of exp(kz) and z exp(kz) from -L to 0; acceleration i omega² exp(kz) at x = 0.
    decay = np.exp(-k * DRAUGHT)
    surge = mass * 1j * omega**2 * (1 - decay) / k
    pitch = mass * 1j * omega**2 * (-1 / k**2 + decay * (DRAUGHT / k + 1 / k**2))
    # The quadrature along the member leaves (k 5 m)^8: below 1e-9 in the shortest wave.
    np.testing.assert_allclose(force[0], surge, rtol=1e-9)
    np.testing.assert_allclose(force[4], pitch, rtol=1e-8)
    np.testing.assert_allclose(force[[1, 3, 5]], 0.0, atol=1e-6)


def test_inertia_force_in_finite_depth_and_oblique_waves() -> None:
    depth, heading = 50.0, 0.7
    components = wave(11.0, heading, depth)
    k, omega = components.wavenumber[0], 2 * np.pi / 11.0
    total = (np.sinh(k * depth) - np.sinh(k * (depth - DRAUGHT))) / (k * np.sinh(k * depth))
    force = inertia_transfer(member(), components, DENSITY)[:, 0]
    expected = DENSITY * 1.9 * SECTION * 1j * omega**2 * total * np.array([np.cos(heading), np.sin(heading)])
    np.testing.assert_allclose(force[:2], expected, rtol=1e-10)


def test_heave_of_a_column_is_the_pressure_on_its_bottom() -> None:
    components = wave(12.0, depth=200.0)
    force = inertia_transfer(member(), components, DENSITY)[2, 0]
    bottom = np.array([[0.0, 0.0, -DRAUGHT]])
    head = pressure_head_transfer(components.wavenumber, 0.0, 200.0, bottom)[0, 0]
    assert force == pytest.approx(DENSITY * GRAVITY * SECTION * head, rel=1e-12)


def test_end_added_mass_follows_the_acceleration_of_the_water() -> None:
    components = wave(12.0)
    bare = inertia_transfer(member(), components, DENSITY)
    ended = inertia_transfer(member(end_added_mass_coefficient=[[0.6, 0.0]]), components, DENSITY)
    k, omega = components.wavenumber[0], 2 * np.pi / 12.0
    mass = 0.6 * DENSITY * np.pi * DIAMETER**3 / 12
    assert (ended - bare)[2, 0] == pytest.approx(-mass * omega**2 * np.exp(-k * DRAUGHT), rel=1e-12)


@pytest.mark.parametrize("direction", [(1.0, 0.0, 0.0), (0.6, 0.8, 0.0), (0.48, -0.36, 0.8)])
def test_closed_member_feels_the_weight_of_water_in_its_volume(direction: tuple[float, float, float]) -> None:
    # Gauss: the Froude-Krylov force on a closed body is rho int a dV, whatever way the member points; no added mass.
    axis = np.array(direction)
    centre, length, section = np.array([4.0, -6.0, -15.0]), 8.0, 9.0
    across = np.cross(axis, [0.3, 0.2, -1.0])
    body = member(
        start=[centre - 0.5 * length * axis],
        end=[centre + 0.5 * length * axis],
        across=[across / np.linalg.norm(across)],
        area=[section],
        added_mass_coefficient=[[0.0, 0.0]],
        end_pressure=[[1.0, 1.0]],
    )
    components = wave(14.0, 0.3)
    force = inertia_transfer(body, components, DENSITY)[:, 0]
    nodes, weights = np.polynomial.legendre.leggauss(12)
    line = centre + 0.5 * length * nodes[:, None] * axis
    omega = 2 * np.pi / 14.0
    acceleration = (
        1j * omega * velocity_transfer(components.angular_frequency, components.wavenumber, 0.3, np.inf, line)[:, :, 0]
    )
    expected = DENSITY * section * 0.5 * length * weights @ acceleration
    np.testing.assert_allclose(force[:3], expected, rtol=1e-9)


def test_transfer_refers_to_the_reference_point() -> None:
    # The same cylinder 40 m down-wave: the force comes later by k 40 m, and yaws nothing in head waves.
    components = wave(9.0)
    shift = np.array([[40.0, 25.0, 0.0]])
    here = inertia_transfer(member(), components, DENSITY)[:, 0]
    there = inertia_transfer(member(start=shift - [0.0, 0.0, DRAUGHT], end=shift), components, DENSITY)[:, 0]
    lag = np.exp(-1j * components.wavenumber[0] * 40.0)
    np.testing.assert_allclose(there[:3], here[:3] * lag, rtol=1e-10)
    assert there[5] == pytest.approx(-25.0 * there[0], rel=1e-12)
    assert there[3] == pytest.approx(here[3] * lag + 25.0 * there[2], rel=1e-10)


def test_added_mass_of_a_vertical_cylinder() -> None:
    matrix = added_mass(member(end_added_mass_coefficient=[[0.6, 0.0]]), DENSITY)
    mass = 0.9 * DENSITY * SECTION * DRAUGHT
    expected = np.zeros((6, 6))
    expected[0, 0] = expected[1, 1] = mass
    expected[2, 2] = 0.6 * DENSITY * np.pi * DIAMETER**3 / 12
    expected[0, 4] = expected[4, 0] = -mass * DRAUGHT / 2
    expected[1, 3] = expected[3, 1] = mass * DRAUGHT / 2
    expected[3, 3] = expected[4, 4] = mass * DRAUGHT**2 / 3
    np.testing.assert_allclose(matrix, expected, rtol=1e-12, atol=1e-6)


def test_drag_of_a_current_on_a_vertical_cylinder() -> None:
    strips = divide(member(), 4.0, DENSITY)
    current = np.array([1.2, -0.5, 0.0])
    force = drag_force(strips, strips.direction @ current)
    local = 0.5 * DENSITY * 0.8 * DIAMETER * DRAUGHT * np.linalg.norm(current) * current
    np.testing.assert_allclose(force[:3], local, rtol=1e-12)
    # It acts at half draught.
    np.testing.assert_allclose(force[3:], np.cross([0.0, 0.0, -DRAUGHT / 2], local), rtol=1e-12)


def test_drag_on_an_inclined_member_is_that_of_the_normal_velocity() -> None:
    axis = np.array([np.sin(0.6), 0.0, np.cos(0.6)])
    inclined = member(start=[-20.0 * axis + [0.0, 0.0, -5.0]], end=[[0.0, 0.0, -5.0]], across=[[0.0, 1.0, 0.0]])
    strips = divide(inclined, 4.0, DENSITY)
    current = np.array([1.5, 0.4, -0.2])
    normal = current - (current @ axis) * axis
    force = drag_force(strips, strips.direction @ current)
    expected = 0.5 * DENSITY * 0.8 * DIAMETER * 20.0 * np.linalg.norm(normal) * normal
    np.testing.assert_allclose(force[:3], expected, rtol=1e-12)


def test_strip_velocities_are_those_of_a_rigid_body() -> None:
    # A cylinder 50 m off the axis of a yawing platform moves at 50 m times the rate, across the arm.
    far = member(start=[[0.0, 50.0, -DRAUGHT]], end=[[0.0, 50.0, 0.0]])
    strips = divide(far, 4.0, DENSITY)
    rates = np.array([0.0, 0.0, 0.3, 0.0, 0.0, 0.02])
    relative = -strips.projection @ rates
    np.testing.assert_allclose(relative.reshape(-1, 2), [[1.0, 0.0]] * 8, atol=1e-15)
    force = drag_force(strips, relative)
    local = 0.5 * DENSITY * 0.8 * DIAMETER * DRAUGHT
    assert force[5] == pytest.approx(-50.0 * local, rel=1e-12)  # against the rotation
    # In pitch, the velocity along x is the rate times z.
    pitching = -strips.projection @ np.array([0.0, 0.0, 0.0, 0.0, 0.1, 0.0])
    np.testing.assert_allclose(pitching[0::2], -0.1 * strips.position[:, 2], rtol=1e-12)


def test_strips_are_equal_and_no_longer_than_asked() -> None:
    for length, count in ((5.0, 6), (4.0, 8), (100.0, 1)):
        strips = divide(member(), length, DENSITY)
        assert len(strips.position) == count
        np.testing.assert_allclose(strips.froude_krylov_mass, DENSITY * SECTION * DRAUGHT / count, rtol=1e-12)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"drag_coefficient": [[-0.1, 0.8]]}, "drag_coefficient holds -0.1; it must be >= 0"),
        ({"area": [np.nan]}, r"area has shape \(1,\); it must be finite"),
        ({"width": [[1.0]]}, r"width has shape \(1, 1\); it must be finite, of shape \(1, 2\)"),
        ({"width": [[1.0, 0.0]]}, "width of a member"),
        ({"end": [[0.0, 0.0, 5.0]]}, r"an end lies at z = 5.0 m"),
        ({"end": [[0.0, 0.0, -DRAUGHT]]}, "length of a member"),
        ({"across": [[0.0, 0.0, 1.0]]}, "unit vectors normal"),
        ({"across": [[2.0, 0.0, 0.0]]}, "unit vectors normal"),
        ({"area": []}, "there are none"),
    ],
)
def test_bad_members_are_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        member(**changes)


def test_bad_arguments_are_refused() -> None:
    with pytest.raises(ScenarioError, match="strip length is 0"):
        divide(member(), 0.0, DENSITY)
    with pytest.raises(ScenarioError, match="water density is -1"):
        added_mass(member(), -1.0)
    with pytest.raises(ScenarioError, match=r"an end lies at z = -30.0 m, below the sea bed at -20.0 m"):
        inertia_transfer(member(), wave(9.0, depth=20.0))
