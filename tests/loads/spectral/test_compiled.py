"""Compiled loops against the matrix algebra that they write out."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tlpsim.loads.spectral.compiled import (
    from_real_products,
    interpolated,
    powers_of_responding,
    responding,
    responses,
    summed_over_diagonals,
    traces,
)

RNG = np.random.default_rng(7)


def random(*shape: int) -> NDArray[np.complex128]:
    return np.asarray(RNG.normal(size=shape) + 1j * RNG.normal(size=shape))


@pytest.mark.parametrize("free", [[0, 1, 2, 3, 4, 5], [1, 4], []])
def test_transfer_functions_are_inverse_impedances(free: list[int]) -> None:
    omega, chosen = np.linspace(0.0, 2.0, 9), np.array(free, dtype=np.int64)
    memory, damping = random(9, 6, 6), 0.1 * RNG.normal(size=(6, 6))
    stiffness, mass = RNG.normal(size=(6, 6)), np.eye(6) + 0.1 * RNG.normal(size=(6, 6))
    stiffness[0, 0] = 0.0  # asks for a pivot from another row
    turn = np.eye(6)
    turn[:2, :2] = [[0.8, -0.6], [0.6, 0.8]]
    found = responses(omega, memory, stiffness, mass, damping, 0.8, 0.6, chosen)
    for n, each in enumerate(omega):
        impedance = stiffness - each**2 * mass + 1j * each * (damping + turn @ memory[n] @ turn.T)
        expected = np.zeros((6, 6), dtype=np.complex128)
        if free:
            expected[np.ix_(free, free)] = np.linalg.inv(impedance[np.ix_(free, free)])
        np.testing.assert_allclose(found[n], expected, rtol=0, atol=1e-12 * (1.0 + np.abs(expected).max()))


@pytest.mark.parametrize("further", [0, 3])
def test_responses_of_hermitian_spectra(further: int) -> None:
    roots, response = random(5, 6 + further, 2), random(5, 6, 6)
    cross = roots @ roots.conj().swapaxes(1, 2)
    cross[2] = 0.0
    whole = np.zeros_like(cross)
    whole[:, :6, :6], whole[:, range(6, 6 + further), range(6, 6 + further)] = response, 1.0
    expected = whole @ cross @ whole.conj().swapaxes(1, 2)
    np.testing.assert_allclose(responding(cross, response), expected, rtol=0, atol=1e-13 * np.abs(expected).max())
    powers = np.einsum("fii->fi", expected).real[:, :6]
    np.testing.assert_allclose(powers_of_responding(cross, response), powers, rtol=0, atol=1e-13 * powers.max())


def test_interpolation_between_whole_numbers() -> None:
    values = random(4, 2, 2)
    place = np.array([-0.1, -1e-8, 0.0, 1.25, 2.9, 3.0, 3.0 + 1e-8, 3.1])
    found = interpolated(values, place, 1e-6)
    for i, j in np.ndindex(2, 2):
        expected = np.interp(place, np.arange(4), values[:, i, j]) * ((place > -1e-6) & (place < 3.0 + 1e-6))
        np.testing.assert_allclose(found[:, i, j], expected, atol=1e-7)


@pytest.mark.parametrize("anti", [False, True])
def test_sums_over_diagonals(anti: bool) -> None:
    size, sources = 4, 2
    matrices = random(3, size * sources, size * sources)
    expected = np.zeros((2 * size - 1 if anti else size, 3, 3), dtype=np.complex128)
    for m, n in np.ndindex(*matrices.shape[1:]):
        at = m % size + n % size if anti else m % size - n % size
        if at >= 0:
            expected[at] += np.outer(matrices[:, m, n], matrices[:, m, n].conj())
    np.testing.assert_allclose(summed_over_diagonals(matrices, size, anti), expected, rtol=0, atol=1e-12)


def test_traces_over_more_than_one_chunk() -> None:
    forms, first, second = (RNG.normal(size=shape) for shape in ((3, 2, 4), (2, 2, 300), (4, 4, 300)))
    expected = np.einsum("iab,bcn,jdc,adn->ijn", forms, second, forms, first, optimize=True)
    np.testing.assert_allclose(traces(forms, first, second), expected, rtol=0, atol=1e-12)


def test_matrices_from_real_products() -> None:
    rows, forms = random(3, 5), RNG.normal(size=(2, 3, 3))
    forms = forms + forms.swapaxes(1, 2)
    pairs = ((rows.real, rows.real), (rows.real, rows.imag), (rows.imag, rows.imag))
    products = (np.ascontiguousarray(np.einsum("am,iab,bn->min", one, forms, other)) for one, other in pairs)
    hermitian, symmetric = from_real_products(*products)
    np.testing.assert_allclose(hermitian, rows.T @ forms @ rows.conj(), rtol=0, atol=1e-12)
    np.testing.assert_allclose(symmetric, rows.T @ forms @ rows, rtol=0, atol=1e-12)
