"""Expanded drag against time series of the drag itself, in a sea whose components are those of the grid."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from tlpsim.loads.hydro.excitation import WaveLoads
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.spectral import viscous
from tlpsim.loads.spectral.model import SpectralWaves
from tlpsim.loads.spectral.problem import SeaOnGrid, sea_on_grid
from tlpsim.loads.spectral.products import Products
from tlpsim.loads.spectral.second_order import SecondOrder, means, spectra, whole
from tlpsim.loads.waves.current import Current, power_law_current, uniform_current
from tlpsim.loads.waves.field import WaveComponents
from tlpsim.loads.waves.sea import SeaState

STATE = SeaState(
    spectrum="pierson_moskowitz", significant_height=7.0, peak_period=13.0, heading=0.4, water_depth=450.0,
    lowest_frequency=0.03, highest_frequency=0.3,
)  # fmt: skip
STEP = 1.0 / 900.0
"""Hz, of the grid: everything repeats after 900 s, so means over a period of products of two waves are exact."""
TIME = 1.5 * np.arange(600)
"""s, one period, in steps that resolve products of the highest waves."""
REST = np.zeros(6)
CURRENTS: dict[str, Current | None] = {
    "none": None,
    "uniform": uniform_current(1.0, 1.0),
    "stretched": power_law_current(1.5, 1.0, 450.0, 2.0, stretched=True),
}
CASES = [
    ("none", False, "vertical"),
    ("uniform", False, "vertical"),
    ("none", True, "vertical"),
    ("uniform", True, "vertical"),
    ("uniform", True, "wheeler"),
    ("stretched", True, "wheeler"),
    ("stretched", True, "vertical"),
]


@dataclass(frozen=True)
class Case:
    """A fixed hull in a sea, in both domains; `values` turns rows on the grid into series (..., time)."""

    sea: SeaOnGrid
    loads: WaveLoads
    drag: viscous.Drag
    linear: viscous.LinearDrag
    wave: NDArray[np.complex128]  # e^{i (omega t + phase)} sqrt(2 step), (N, time)

    def values(self, rows: NDArray[np.complex128]) -> NDArray[np.float64]:
        return np.asarray((rows @ self.wave).real)

    def series(self, position: NDArray[np.float64] = REST, velocity: NDArray[np.float64] = REST) -> NDArray:
        """Drag (6, time)."""
        return np.array([self.loads.evaluate(t, position, velocity).viscous for t in TIME]).T


@cache
def case(current: str, splash: bool, stretching: str, seed: int = 0) -> Case:
    waves = SpectralWaves(
        state=STATE,
        members=issc_members(),
        current=CURRENTS[current],
        splash=splash,
        stretching=stretching,
        sharp_band=True,
        strip_length=2.5,
    )
    sea = sea_on_grid(waves, STEP)
    grid = sea.grid
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(grid.root))
    harmonic = WaveComponents(
        frequency=grid.frequency,
        amplitude=grid.root * np.sqrt(2.0 * STEP),
        phase=phase,
        wavenumber=grid.sea.wavenumber,
        heading=grid.sea.heading,
        water_depth=STATE.water_depth,
        gravity=STATE.gravity,
    )
    fixed = np.zeros((6, len(grid.root)), dtype=np.complex128)
    strips, pieces = (
        viscous.relative_rows(elements, rows, fixed, grid.omega)
        for elements, rows in zip(sea.elements, sea.rows, strict=True)
    )
    none = np.zeros((6, 6))
    of_strips, _ = viscous.covariances(sea.elements[0], *strips, STEP, none)
    of_pieces, cross = viscous.covariances(sea.elements[1], *pieces, STEP, none)
    up = np.zeros(len(sea.elements[1].position))
    drag = viscous.expanded(sea.elements, (of_strips, of_pieces), cross, up)
    return Case(
        sea=sea,
        loads=WaveLoads(
            sea=harmonic,
            members=waves.members,
            current=waves.current,
            splash=splash,
            stretching=stretching,
            largest_elevation=12.0,
            strip_length=2.5,
        ),
        drag=drag,
        linear=viscous.linear_drag(drag),
        wave=np.exp(1j * (np.outer(grid.omega, TIME) + phase[:, None])) * np.sqrt(2.0 * STEP),
    )


def second_order(found: Case) -> SecondOrder:
    """Products of a fixed hull by part."""
    sea = found.sea
    strips, pieces = sea.rows
    products = {
        "viscous": viscous.viscous_products(found.drag, strips.water),
        "splash": viscous.splash_products(found.drag, pieces.water, pieces.elevation),
        "following": viscous.following_products(found.drag, strips.elevation, strips),
    }
    return SecondOrder(products=products, drift=None)


def product_series(found: Case, products: Products) -> NDArray[np.float64]:
    """Quadratic loads (6, time)."""
    return np.asarray(products.weights @ (found.values(products.first) * found.values(products.second)))


def regressions(current: str, splash: bool, stretching: str) -> NDArray[np.float64]:
    """Of six realizations the mean, the spread, factors of what is linear and quadratic and shares of it and the rest.

    Shape (6, realizations, 6).
    """
    rows = []
    for seed in range(6):
        found = case(current, splash, stretching, seed)
        series = found.series()
        linear = found.values(viscous.wave_loads(found.linear, *found.sea.rows))
        products = [product_series(found, each) for each in second_order(found).products.values()]
        square = np.sum(products, axis=0)
        square -= square.mean(axis=1, keepdims=True)
        free = series - series.mean(axis=1, keepdims=True)
        size, own = free.var(axis=1), square.var(axis=1)
        factors = [np.mean(free * each, axis=1) for each in (linear, square)]
        factors = [factors[0] / linear.var(axis=1), factors[1] / np.maximum(own, 1e-9 * size)]
        rest = (free - linear - square).var(axis=1)
        rows.append([series.mean(axis=1), np.sqrt(size), *factors, own / size, rest / size])
    return np.array(rows).swapaxes(0, 1)


@pytest.mark.parametrize("setting", CASES, ids=str)
def test_expansion_against_the_drag_in_time(setting: tuple[str, bool, str]) -> None:
    """Mean, what is linear in the waves, and what is quadratic, each with the factor that leaves least.

    Within four standard errors of six realizations, 2 %, and what is of the third order of the wave's height or more:
    a trough bares what moves slower than the surface, some 15 % of the splash zone's share in waves of 7 m; its drag
    acts above mean water level; the change of a current that follows it is neither in the variance nor in the
    products; and where velocities follow the surface their change with it is not linear, k² σ² or a tenth.
    """
    current, splash, stretching = setting
    found, record = case(*setting), regressions(*setting)
    mean, spread, linear, square, share, rest = record.mean(axis=1)
    error = 4.0 * record.std(axis=1, ddof=1) / np.sqrt(record.shape[1])
    parts = means(second_order(found), found.sea.grid)
    expected = found.linear.mean + found.linear.splash_mean + parts["following"]
    zone = 0.15 * np.abs(found.linear.splash_mean)
    zone[3:5] = 1.75 * np.abs(found.linear.splash_mean)[[1, 0]]  # m, a lever of one standard deviation of the elevation
    follows = stretching == "wheeler"
    above = 0.06 * spread if follows else zone + 0.01 * np.abs(expected) * (current == "stretched")
    assert np.all(np.abs(mean - expected) <= error[0] + above + 2e-3 * spread)
    assert np.all(np.abs(linear - 1.0) <= error[2] + (0.1 if follows else 0.02))
    counts, model = share > 0.02, 0.02
    if splash:
        model = 0.2 if follows or current == "none" else {"uniform": 0.06, "stretched": 0.1}[current]
    assert counts[:2].all() == (current != "none" or splash)
    assert np.all(np.abs(square - 1.0)[counts] <= error[3][counts] + model)
    assert np.all(error[2] < 0.06)
    assert np.all(error[3][counts] < (0.45 if current == "none" else 0.25))
    # What is left is the third power: without current and mean flow 1 - (8 / pi) / 3 of the variance of u|u|.
    if current == "none":
        # In one direction; the surface and the pontoons leave a little more.
        np.testing.assert_allclose(rest[:2], 1.0 - 8.0 / (3.0 * np.pi), atol=0.02)
        assert rest.max() < 0.21
    else:
        assert rest.max() < 0.035


@pytest.mark.parametrize("setting", [("uniform", True, "vertical"), ("stretched", True, "wheeler")], ids=str)
def test_spectra_of_products_hold_the_variance_of_their_series(setting: tuple[str, bool, str]) -> None:
    """Over twenty realizations, whose few slow groups leave 3 %."""
    found = case(*setting)
    grid, parts, rng = found.sea.grid, second_order(found), np.random.default_rng(5)
    both = spectra(whole(parts, found.sea.grid), found.sea.grid)
    slow, fast = (np.einsum("fii->fi", each.values).real for each in (both.difference, both.total))
    expected = STEP * (slow[1:].sum(axis=0) + fast.sum(axis=0))  # a difference of zero is a mean in a record
    variances = []
    for _ in range(20):
        turn = rng.normal(size=(len(found.wave), 2)) @ np.array([1.0, 1.0j])
        energy = np.sum(np.abs(turn * grid.root) ** 2) / np.sum(grid.root**2)
        again = replace(found, wave=found.wave * (turn / np.sqrt(energy))[:, None])
        series = np.sum([product_series(again, each) for each in parts.products.values()], axis=0)
        variances.append(series.var(axis=1))
    np.testing.assert_allclose(np.mean(variances, axis=0), expected, rtol=0.08)


@pytest.mark.parametrize("setting", CASES, ids=str)
def test_damping_is_the_mean_change_of_drag_with_velocity(setting: tuple[str, bool, str]) -> None:
    """Over the same waves, so that little is left to chance: 3 % of the largest in each row, as scaled."""
    found = case(*setting)
    scale = np.array([1.0, 1.0, 1.0, 0.02, 0.02, 0.02])  # m/s and rad/s of like velocities at the hull
    columns = []
    for unit in np.eye(6):
        ahead, behind = (found.series(velocity=sign * 0.02 * scale * unit).mean(axis=1) for sign in (1.0, -1.0))
        columns.append((behind - ahead) / 0.04)
    measured = np.column_stack(columns) * scale[:, None]
    expected = found.linear.damping * scale * scale[:, None]
    follows = setting[2] == "wheeler"
    np.testing.assert_allclose(measured, expected, atol=(0.06 if follows else 0.03) * np.abs(expected).max())
    assert np.linalg.eigvalsh(expected + expected.T)[0] > 0.0


@pytest.mark.parametrize("setting", [("uniform", True, "vertical"), ("stretched", True, "vertical")], ids=str)
def test_stiffness_is_the_mean_change_of_drag_with_the_water_line(setting: tuple[str, bool, str]) -> None:
    """A platform that rises has less drag on what is wet; a current that follows the surface moves with it.

    The drag of the splash zone acts half an elevation r above mean water level, r² f / 2 as a moment: it changes with
    heave by the mean force r f, which the expansion leaves out.
    """
    for degree, step in ((2, 0.2), (3, 0.005), (4, 0.005), (5, 0.01)):
        rows = []
        for seed in range(4):
            found, unit = case(*setting, seed), step * np.eye(6)[degree]
            ahead, behind = (found.series(position=sign * unit).mean(axis=1) for sign in (1.0, -1.0))
            rows.append((behind - ahead) / (2.0 * step))
        measured, expected = np.mean(rows, axis=0), found.linear.stiffness[:, degree].copy()
        error = 4.0 * np.std(rows, axis=0, ddof=1) / np.sqrt(len(rows)) + 0.08 * np.abs(expected).max()
        assert np.abs(expected).max() > 0.0 or degree == 5
        if degree == 2:
            zone = found.linear.splash_mean
            expected[3:5] += np.array([-zone[1], zone[0]])
            assert np.all(np.abs(measured - expected) <= error + 0.1 * np.abs(zone[0]))
        else:
            assert np.all(np.abs(measured - expected)[[0, 1, 5]] <= error[[0, 1, 5]])


def test_a_mean_setdown_adds_its_length_of_column() -> None:
    """The mean drag with the platform half a metre down, against r_0 in eq. (4)."""
    found = case("uniform", True, "vertical")
    lower = viscous.linear_drag(replace(found.drag, rise=found.drag.rise + 0.5))
    down = np.array([0.0, 0.0, -0.5, 0.0, 0.0, 0.0])
    measured = found.series(position=down).mean(axis=1) - found.series().mean(axis=1)
    expected = lower.splash_mean - found.linear.splash_mean
    np.testing.assert_allclose(measured[:2], expected[:2], rtol=0.1)
    # The damping of half a metre more of four columns: E d(|V| V)/dV of it.
    more = (lower.damping - found.linear.damping)[:2, :2]
    slower = [
        [found.series(position=at, velocity=0.02 * sign * unit).mean(axis=1)[:2] for sign in (-1.0, 1.0)]
        for at in (REST, down)
        for unit in np.eye(6)[:2]
    ]
    change = np.array([(behind - ahead) / 0.04 for behind, ahead in slower])
    np.testing.assert_allclose((change[2:] - change[:2]).T, more, atol=0.1 * np.abs(more).max())


def test_covariances_are_those_of_the_relative_velocities_in_time() -> None:
    """A platform that moves with the waves, and beside them with a velocity of its own."""
    found = case("uniform", True, "wheeler")
    grid, rng = found.sea.grid, np.random.default_rng(3)
    size = np.array([1.0, 0.6, 0.2, 0.01, 0.02, 0.01])[:, None] * grid.root
    position = size * (rng.normal(size=size.shape) + 1j * rng.normal(size=size.shape))
    root = rng.normal(size=(6, 6)) * np.array([0.3, 0.3, 0.1, 1e-3, 1e-3, 5e-3])[:, None]
    motion, rates = found.values(position), found.values(1j * grid.omega * position)
    for elements, rows in zip(found.sea.elements, found.sea.rows, strict=True):
        relative, elevation = viscous.relative_rows(elements, rows, position, grid.omega)
        within, cross = viscous.covariances(elements, relative, elevation, STEP, root @ root.T)
        water, rise = found.values(rows.water), found.values(rows.elevation)
        for s, place in enumerate(elements.position):
            point = rates[:3] + np.cross(rates[3:], place, axisa=0, axisb=0, axisc=0)
            beside = root[:3] + np.cross(root[3:], place, axisa=0, axisb=0, axisc=0)
            axes = elements.projection[s, :, :3]
            speed, own = water[s] - axes @ point, axes @ beside
            up = rise[s] - (motion[2] + motion[3] * place[1] - motion[4] * place[0])
            np.testing.assert_allclose(within[s], speed @ speed.T / len(TIME) + own @ own.T, rtol=1e-9, atol=1e-12)
            np.testing.assert_allclose(cross[s], speed @ up / len(TIME), rtol=1e-9, atol=1e-12)


def test_members_without_drag_and_water_without_waves_have_no_elements() -> None:
    waves = SpectralWaves(state=STATE, members=issc_members(0.0))
    assert len(viscous.strips(waves).position) == len(viscous.surface_pieces(waves).position) == 0
    calm = SpectralWaves(state=replace(STATE, significant_height=0.0), members=issc_members(), stretching="wheeler")
    assert len(viscous.surface_pieces(calm).position) == 0
    assert not viscous.strips(calm).level.any()
    assert len(viscous.surface_pieces(SpectralWaves(state=STATE, members=issc_members())).position) == 4
    ends = SpectralWaves(state=STATE, members=issc_members(), stretching="none")
    assert len(viscous.surface_pieces(ends).position) == 0
    linear = viscous.linear_drag(
        viscous.expanded((viscous.strips(waves),) * 2, (np.zeros((0, 2, 2)),) * 2, np.zeros((0, 2)), np.zeros(0))
    )
    assert not linear.mean.any()
    assert not linear.damping.any()
