"""Finite-depth Green function against direct quadrature, the eigenfunction series and the equations that it solves."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import special

from tlpsim.loads.bem.green import bottom_wave, deep_table, deep_wave, finite_table, finite_wave
from tlpsim.loads.bem.green_finite import _series
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.airy import STANDARD_GRAVITY, wavenumber

DEPTH = 80.0
NONDIMENSIONAL_WAVENUMBERS = [0.5, 0.9, 1.6, 3.0, 5.5, 9.0, 13.0, 20.0, 30.0, 50.0]


def deep_number(kh):
    return kh / DEPTH * np.tanh(kh)


def table_of(kh, distance, draft):
    return finite_table(deep_number(kh), DEPTH, distance, draft)


def rankine(radius, z, zeta, depth=DEPTH):
    """1/r + 1/r1 + 1/r2 and its derivatives by R and z."""
    height = np.array([z - zeta, z + zeta, z + zeta + 2.0 * depth])
    r = np.hypot(radius, height)
    return np.array([np.sum(1.0 / r), np.sum(-radius / r**3), np.sum(-height / r**3)])


def green(radius, z, zeta, table):
    """All of G and its derivatives by R and z."""
    return np.array(finite_wave(radius, z, zeta, table)) + rankine(radius, z, zeta, table.depth)


def reference(radius, z, zeta, kh):
    """The wave part by Wehausen & Laitone's eq. (13.18): a principal value on the real axis and a residue.

    G = 1/r + 1/r2 + PV integral f J0(mu R) dmu - i pi Res,
    f = 2 (mu + K) exp(-mu D) cosh mu(z+D) cosh mu(zeta+D) / (mu sinh mu D - K cosh mu D). Gauss-Legendre panels that
    are mirrored in the pole k over 0..2k cancel its odd part; 1/r1 is taken out under the integral.
    """
    number, k = deep_number(kh), kh / DEPTH
    total, difference = -(z + zeta), abs(z - zeta)
    nodes, weights = np.polynomial.legendre.leggauss(16)
    step = min(4.0 / (radius + DEPTH), 0.3 * number)
    half = np.linspace(0.0, k, int(np.ceil(k / step)) + 1)
    edges = np.concatenate([half, 2.0 * k - half[-2::-1], np.arange(2.0 * k, 2.0 * k + 42.0 / total, step)[1:]])
    middle, width = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    mu = (middle[:, None] + width[:, None] * nodes).ravel()
    weight = (width[:, None] * weights).ravel()

    bottom = np.exp(-2.0 * mu * DEPTH)
    with np.errstate(divide="ignore"):
        factor = (mu + number) / (mu - number - (mu + number) * bottom)

    def pair(height, sign):
        return np.exp(-mu * (2.0 * DEPTH - height)) + sign * np.exp(-mu * (2.0 * DEPTH + height))

    side = np.sign(z - zeta)
    image = np.exp(-mu * total)
    even = factor * (pair(difference, 1.0) + pair(2.0 * DEPTH - total, 1.0)) - image
    odd = mu * (factor * (side * pair(difference, -1.0) + pair(2.0 * DEPTH - total, -1.0)) - image)
    real = [
        np.sum(weight * even * special.j0(mu * radius)),
        -np.sum(weight * even * mu * special.j1(mu * radius)),
        np.sum(weight * odd * special.j0(mu * radius)),
    ]
    amplitude = k**2 / ((k**2 - number**2) * DEPTH + number)

    def shape(height):  # cosh k(z + D) / cosh kD and its derivative
        below = np.exp(-2.0 * k * (height + DEPTH))
        scale = np.exp(k * height) / (1.0 + np.exp(-2.0 * kh))
        return scale * (1.0 + below), k * scale * (1.0 - below)

    source = 2.0 * np.pi * amplitude * shape(zeta)[0]
    imaginary = [
        -source * shape(z)[0] * special.j0(k * radius),
        source * shape(z)[0] * k * special.j1(k * radius),
        -source * shape(z)[1] * special.j0(k * radius),
    ]
    return np.array(real) + 1j * np.array(imaginary)


@pytest.mark.parametrize("kh", NONDIMENSIONAL_WAVENUMBERS)
@pytest.mark.parametrize(("reach", "draft"), [(0.3, 0.1), (1.5, 0.4), (6.0, 1.0)])
def test_agrees_with_direct_quadrature(kh, reach, draft):
    # 5e-7 of the value and of the gradient: the tables hold 1e-7, and 4e-7 for a body that fills the depth
    table = table_of(kh, reach * DEPTH, draft * DEPTH)
    places = np.random.default_rng(7).uniform(size=(12, 3))
    for a, b, c in places:
        radius = reach * DEPTH * a**2
        z, zeta = -draft * DEPTH * (0.03 + 0.97 * np.array([b, c]))
        expected = reference(radius, z, zeta, kh)
        error = np.abs(np.array(finite_wave(radius, z, zeta, table)) - expected)
        assert error[0] < 5e-7 * abs(expected[0])
        assert max(error[1:]) < 5e-7 * np.hypot(*np.abs(expected[1:]))


@pytest.mark.parametrize("kh", NONDIMENSIONAL_WAVENUMBERS)
def test_tables_and_eigenfunctions_agree(kh):
    # two unlike methods where both serve; G is the difference of larger terms, hence absolute in terms of 1/r
    table = table_of(kh, 4.0 * DEPTH, DEPTH)
    for radius in np.array([0.6, 1.0, 1.9, 3.3]) * DEPTH:
        for z, zeta in ((-0.01, -0.2), (-0.5, -0.05), (-1.0, -0.7), (0.0, -1.0)):
            by_tables = green(radius, z * DEPTH, zeta * DEPTH, table)
            by_series = np.array(_series(radius, z * DEPTH, zeta * DEPTH, table))
            scale = np.array([1.0, 1.0 / DEPTH, 1.0 / DEPTH])
            scale *= 1.0 / radius + abs(by_series[0]) + DEPTH * abs(by_series[1]) + DEPTH * abs(by_series[2])
            assert np.all(np.abs(by_tables - by_series) < 1e-6 * scale)


@given(
    kh=st.sampled_from([0.5, 2.0, 8.0, 40.0]),
    radius=st.floats(0.01, 3.0),
    z=st.floats(-0.6, 0.0),
    zeta=st.floats(-0.6, -0.01),
)
@settings(max_examples=150, deadline=None)
def test_boundary_conditions_and_symmetry(kh, radius, z, zeta):
    table = TABLES[kh]
    radius, z, zeta = radius * DEPTH, z * DEPTH, zeta * DEPTH
    here, there = finite_wave(radius, z, zeta, table), finite_wave(radius, zeta, z, table)
    assert here[0] == pytest.approx(there[0], rel=1e-9)
    assert here[1] == pytest.approx(there[1], rel=1e-9)

    value, _, vertical = green(radius, 0.0, zeta, table)
    # dG/dz = K G on the surface, to the accuracy of the tables in K times the largest part of G there
    size = table.deep_number * (abs(value) + 2.0 / np.hypot(radius, zeta)) + abs(vertical)
    assert abs(vertical - table.deep_number * value) < 1e-6 * size


@given(kh=st.sampled_from([0.5, 2.0, 8.0, 40.0]), radius=st.floats(0.0, 8.0), zeta=st.floats(-0.98, 0.0))
@settings(max_examples=150, deadline=None)
def test_no_flow_through_the_bottom(kh, radius, zeta):
    table = WHOLE_DEPTH[kh]
    _, slope, vertical = green(radius * DEPTH, -DEPTH, zeta * DEPTH, table)
    r = np.hypot(radius, 1.0 + zeta) * DEPTH
    assert abs(vertical) < 1e-6 * (1.0 / r**2 + abs(slope))


@given(
    kh=st.sampled_from([0.5, 2.0, 8.0, 40.0]),
    radius=st.floats(0.05, 5.0),
    z=st.floats(-0.95, -0.03),
    zeta=st.floats(-1.0, 0.0),
)
@settings(max_examples=150, deadline=None)
def test_is_harmonic(kh, radius, z, zeta):
    # fourth-order differences of the derivatives; the floor is the tables' 1e-7 of the gradient over the step
    table = WHOLE_DEPTH[kh]
    radius, z, zeta = radius * DEPTH, z * DEPTH, zeta * DEPTH
    step = 0.02 * min(radius, -z, DEPTH / kh)
    offsets, weights = np.array([-2, -1, 1, 2]) * step, np.array([1, -8, 8, -1]) / (12.0 * step)
    slope = finite_wave(radius, z, zeta, table)[1]
    along = sum(w * finite_wave(radius + o, z, zeta, table)[1] for o, w in zip(offsets, weights, strict=True))
    up = sum(w * finite_wave(radius, z + o, zeta, table)[2] for o, w in zip(offsets, weights, strict=True))
    # a change from tables to series within the stencil shows the difference of the two, 1e-7, over the step
    gradient = np.hypot(*np.abs(finite_wave(radius, z, zeta, table)[1:]))
    size = abs(along) + abs(slope / radius) + abs(up) + 0.1 * gradient / step
    assert abs(along + slope / radius + up) < 5e-5 * size


def test_tends_to_deep_water():
    # what the bottom changes is of order 1/D of the images next to G ~ 1/R
    depth, number = 2e4, 0.05
    table = finite_table(number, depth, 100.0, 40.0)
    for radius, z, zeta in ((0.0, -3.0, -5.0), (12.0, -1.0, -20.0), (90.0, 0.0, -2.0)):
        deep = np.array(deep_wave(number * radius, number * (z + zeta), deep_table())) * [number, number**2, number**2]
        finite = np.array(finite_wave(radius, z, zeta, table))
        assert abs(finite[0] - deep[0]) < 4.0 / depth
        assert np.all(np.abs(finite - deep)[1:] < 20.0 / depth**2)


@pytest.mark.parametrize("kh", [0.5, 2.0, 8.0])
def test_far_field_is_the_outgoing_wave_of_the_dispersion_relation(kh):
    # John's far field, with k from the room of waves: the local modes are down by exp(-pi/2 R/D)
    table = table_of(kh, DEPTH, 0.5 * DEPTH)
    number = deep_number(kh)
    k = float(wavenumber(np.sqrt(number * STANDARD_GRAVITY), DEPTH))
    radius, z, zeta = 20.0 * DEPTH, -0.1 * DEPTH, -0.3 * DEPTH
    amplitude = (k**2 - number**2) / ((k**2 - number**2) * DEPTH + number)
    shape = np.cosh(k * (z + DEPTH)) * np.cosh(k * (zeta + DEPTH))
    wave = -2j * np.pi * amplitude * shape * special.hankel2(0, k * radius)
    assert green(radius, z, zeta, table)[0] == pytest.approx(wave, rel=1e-7)


def test_flux_through_a_distant_cylinder_is_that_of_the_source():
    # Energy: by Green's theorem for G and its conjugate, with the sphere about the source where G ~ 1/r,
    # integral of Im(G* G_R) over any cylinder around it = 4 pi Im G at the source.
    kh, zeta = 1.3, -0.2 * DEPTH
    table = table_of(kh, DEPTH, DEPTH)
    radius = 9.0 * DEPTH
    nodes, weights = np.polynomial.legendre.leggauss(30)
    heights = 0.5 * DEPTH * (nodes - 1.0)
    points = [green(radius, z, zeta, table) for z in heights]
    flux = sum(w * 0.5 * DEPTH * (np.conj(p[0]) * p[1]).imag for w, p in zip(weights, points, strict=True)) * (
        2.0 * np.pi * radius
    )
    assert flux == pytest.approx(4.0 * np.pi * finite_wave(0.0, zeta, zeta, table)[0].imag, rel=1e-6)


def test_beyond_the_table():
    table = table_of(2.0, DEPTH, 0.2 * DEPTH)
    wide = table_of(2.0, 3.0 * DEPTH, DEPTH)
    # farther than the reach, and deeper than the draft: by the series
    for place in ((2.0 * DEPTH, -3.0, -10.0), (0.8 * DEPTH, -0.6 * DEPTH, -1.0)):
        assert finite_wave(*place, table)[0] == pytest.approx(finite_wave(*place, wide)[0], rel=1e-6)
    assert np.isnan(finite_wave(0.1 * DEPTH, -0.6 * DEPTH, -1.0, table)[0])
    assert np.isnan(finite_wave(np.nan, -1.0, -1.0, table)[0])


@pytest.mark.parametrize("place", [(20.0, -3.0, -30.0), (20.0, -30.0, -3.0), (0.0, -1.0, -1.0), (700.0, -9.0, -0.5)])
def test_bottom_wave_is_finite_less_deep_water(place):
    radius, z, zeta = place
    for kh in (0.5, 8.0):
        table = TABLES[kh]
        number = table.deep_number
        deep = np.array(deep_wave(number * radius, number * (z + zeta), deep_table())) * [number, number**2, number**2]
        value, slope, vertical, source_vertical = bottom_wave(radius, z, zeta, table)
        # the same tables on both sides; at equal heights dA/ds is the tables' error, well below 1e-8, with either sign
        scale = 1e-8 * (np.abs(deep) + np.array([1.0 / DEPTH, 1.0 / DEPTH**2, 1.0 / DEPTH**2]))
        assert np.all(np.abs(np.array([value, slope, vertical]) + deep - finite_wave(radius, z, zeta, table)) < scale)
        assert abs(source_vertical + deep[2] - finite_wave(radius, zeta, z, table)[2]) < scale[2]


@pytest.mark.parametrize(
    "arguments", [(0.0, 80.0, 10.0, 10.0), (0.1, np.inf, 10.0, 10.0), (0.1, 80.0, -1.0, 10.0), (0.1, 80.0, 10.0, 81.0)]
)
def test_refuses_bad_arguments(arguments):
    with pytest.raises(ScenarioError):
        finite_table(*arguments)


def test_table_is_built_anew_by_pickle():
    table = TABLES[2.0]
    again = pickle.loads(pickle.dumps(table))
    assert finite_wave(5.0, -1.0, -2.0, again) == finite_wave(5.0, -1.0, -2.0, table)


TABLES = {kh: table_of(kh, 3.0 * DEPTH, 0.6 * DEPTH) for kh in (0.5, 2.0, 8.0, 40.0)}
WHOLE_DEPTH = {kh: table_of(kh, 3.0 * DEPTH, DEPTH) for kh in (0.5, 2.0, 8.0, 40.0)}
