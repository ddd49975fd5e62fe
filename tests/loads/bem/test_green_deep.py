"""Deep-water Green function against direct quadrature, closed forms and the equations that it solves."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import special
from scipy.integrate import quad

from tlpsim.loads.bem.green import deep_table, deep_wave
from tlpsim.loads.bem.green_deep import bessel_all

TABLE = deep_table()


def principal_value(h, depth, power, bessel):
    """PV integral of exp(-mu V) mu^power J(mu h) / (mu - 1) over mu = 0..inf, by QUADPACK."""

    def numerator(mu):
        return np.exp(-mu * depth) * mu**power * bessel(mu * h)

    around, _ = quad(numerator, 0.0, 2.0, weight="cauchy", wvar=1.0, epsabs=1e-13, epsrel=1e-12, limit=400)
    tail, edge = 0.0, 2.0
    step = min(3.0 / max(h, 1e-9), 2.0 / depth)  # shorter than a wave and than the decay: smooth pieces
    while edge * depth < 40.0:
        piece, _ = quad(lambda mu: numerator(mu) / (mu - 1.0), edge, edge + step, epsabs=1e-13, epsrel=1e-10)
        tail, edge = tail + piece, edge + step
    return around + tail


def reference(h, depth):
    """g, dg/dh, dg/dv by quadrature of the defining integral and of its derivatives."""
    wave = 2.0 * np.pi * np.exp(-depth)
    return np.array(
        [
            2.0 * principal_value(h, depth, 0, special.j0) - 1j * wave * special.j0(h),
            -2.0 * principal_value(h, depth, 1, special.j1) + 1j * wave * special.j1(h),
            2.0 * principal_value(h, depth, 1, special.j0) - 1j * wave * special.j0(h),
        ]
    )


@pytest.mark.parametrize("depth", [0.05, 0.3, 1.0, 3.3, 9.0, 18.0, 30.0])
@pytest.mark.parametrize("h", [0.02, 0.4, 1.7, 4.9, 11.0, 19.5, 26.0, 45.0])
def test_agrees_with_direct_quadrature(h, depth):
    # 2e-7 of each: the tables hold 5e-8, the promise is 1e-6; QUADPACK's own error is some 1e-12 in absolute terms
    expected = reference(h, depth)
    assert np.all(np.abs(np.array(deep_wave(h, -depth, TABLE)) - expected) < 2e-7 * np.abs(expected) + 5e-12)


@pytest.mark.parametrize("h", np.geomspace(1e-3, 300.0, 40))
def test_closed_form_on_the_free_surface(h):
    # F(h, 0) = -pi/2 (H0 + Y0), and its derivative
    value = -np.pi * (special.struve(0, h) + special.y0(h)) - 2j * np.pi * special.j0(h)
    slope = -np.pi * (2.0 / np.pi - special.struve(1, h) - special.y1(h)) + 2j * np.pi * special.j1(h)
    g, g_h, g_v = deep_wave(h, 0.0, TABLE)
    assert abs(g - value) < 1e-7 * abs(value)
    assert abs(g_h - slope) < 1e-7 * abs(slope)
    assert abs(g_v - (value + 2.0 / h)) < 1e-7 * abs(value + 2.0 / h)


@pytest.mark.parametrize("depth", np.geomspace(1e-3, 300.0, 40))
def test_closed_form_above_the_source(depth):
    # F(0, V) = -exp(-V) Ei(V); the scaled form avoids its overflow
    scaled = special.expi(depth) * np.exp(-depth)
    value = -2.0 * scaled - 2j * np.pi * np.exp(-depth)
    g, g_h, g_v = deep_wave(0.0, -depth, TABLE)
    assert abs(g - value) < 1e-7 * abs(value)
    assert g_h == 0.0
    # the sum of two large numbers leaves 1e-16 V of it to the reference
    assert abs(g_v - (value + 2.0 / depth)) < 1e-7 * abs(value + 2.0 / depth) + 1e-13


def test_slope_keeps_its_relative_accuracy_near_the_axis():
    # h -> 0: g_h / h -> -1/2 g_vv (Laplace), with g_vv = g_v + 2/V² = g + 2/V + 2/V²
    for depth in (0.3, 2.0, 7.0, 30.0):
        g, _, _ = deep_wave(0.0, -depth, TABLE)
        curvature = g + 2.0 / depth + 2.0 / depth**2
        _, slope, _ = deep_wave(1e-6, -depth, TABLE)
        assert slope / 1e-6 == pytest.approx(-0.5 * curvature, rel=1e-6)


def test_logarithm_at_the_singular_point():
    for h, depth in ((1e-6, 0.0), (0.0, 1e-6), (3e-7, 4e-7)):
        g, _, _ = deep_wave(h, -depth, TABLE)
        expected = -2.0 * (np.log(0.5 * (np.hypot(h, depth) + depth)) + np.euler_gamma) - 2j * np.pi
        assert g == pytest.approx(expected, abs=1e-4)  # what follows is of order d ln d
    assert np.all(np.isfinite(deep_wave(0.0, 0.0, TABLE)))


@given(h=st.floats(0.05, 80.0), depth=st.floats(0.0, 40.0))
@settings(max_examples=200, deadline=None)
def test_is_harmonic(h, depth):
    # g_hh + g_h/h + g_vv = 0 by fourth-order differences of the derivatives; the step's error is that of tables, 1e-8,
    # over the step, and of the fifth derivative, which near the axes scales with the distance d
    step = 0.02 * min(1.0, h)
    offsets, weights = np.array([-2, -1, 1, 2]) * step, np.array([1, -8, 8, -1]) / (12.0 * step)
    slope = deep_wave(h, -depth, TABLE)[1]
    along = sum(w * deep_wave(h + o, -depth, TABLE)[1] for o, w in zip(offsets, weights, strict=True))
    d = np.hypot(h, depth)
    g, _, _ = deep_wave(h, -depth, TABLE)
    vertical = g + 2.0 / d + 2.0 * depth / d**3  # derivative of g_v = g + 2/d by v
    size = abs(along) + abs(slope / h) + abs(vertical)
    assert abs(along + slope / h + vertical) < 2e-5 * size


@given(h=st.floats(0.0, 200.0), depth=st.floats(0.0, 60.0))
@settings(max_examples=300, deadline=None)
def test_is_continuous_over_cells(h, depth):
    # a step of 1e-10 may change g by its gradient times that; a jump between polynomials would show
    g, g_h, g_v = deep_wave(h, -depth, TABLE)
    if np.hypot(h, depth) > 1e-3:
        shifted = deep_wave(h + 1e-10, -depth - 1e-10, TABLE)
        assert abs(shifted[0] - g) <= 2e-7 * abs(g)
        assert abs(shifted[2] - g_v) <= 2e-7 * (abs(g_v) + abs(g_h))


@pytest.mark.parametrize("depth", [0.0, 0.7, 3.0])
def test_far_field_is_an_outgoing_wave(depth):
    # -2 pi i exp(v) H0^(2)(h) and the local -2/d, what follows is of order V/d²
    h = 500.0
    wave = -2j * np.pi * np.exp(-depth) * special.hankel2(0, h)
    d = np.hypot(h, depth)
    assert deep_wave(h, -depth, TABLE)[0] == pytest.approx(wave - 2.0 / d, abs=2.0 * (depth + 0.1) / d**2)


def test_bessel_functions():
    for h in np.concatenate([np.geomspace(1e-4, 8.0, 60), np.linspace(7.9, 8.1, 21), np.geomspace(8.0, 1e4, 60)]):
        got = np.array(bessel_all(h, TABLE))
        expected = np.array([special.j0(h), special.j1(h), special.y0(h), special.y1(h)])
        # relative to the envelope; far out the phase itself is known to 1e-16 h
        assert np.all(np.abs(got - expected) < 2e-9 * np.maximum(np.abs(expected), np.sqrt(1.0 / h)))


def test_points_that_are_no_numbers_are_answered_by_none():
    assert np.isnan(deep_wave(np.nan, -1.0, TABLE)[0])
    assert np.isnan(deep_wave(1.0, np.nan, TABLE)[0])


def test_table_is_built_anew_by_pickle():
    again = pickle.loads(pickle.dumps(TABLE))
    assert deep_wave(1.0, -1.0, again) == deep_wave(1.0, -1.0, TABLE)
