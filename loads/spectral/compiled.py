"""Compiled loops over frequencies: transfer functions, and cross-spectra of what responds by them.

    H = (K - omega² M + i omega (B + P W P^T))^-1,   P = diag(Rz(yaw), 1)                                 (1)
    y = diag(H, 1) z,   S_y = diag(H, 1) S_z diag(H, 1)^H                                                 (2)

z of eq. (2) are six generalized forces, and further quantities that pass as they are. Matrices of six rows are so small
that a call of a library for each of thousands takes longer than the sums themselves.
"""

import numpy as np
from numba import njit

from tlpsim.loads.platform.integration import eliminate

_CHUNK = 128  # of the last axis, so that what is summed stays near the processor


@njit(cache=True)
def _invert(matrix, size):  # type: ignore[no-untyped-def]
    """Inverse of the first `size` rows and columns in place, by Gauss and Jordan with row pivots."""
    rows = np.empty(size, dtype=np.int64)
    for k in range(size):
        at, largest = k, -1.0
        for i in range(k, size):
            value = matrix[i, k].real ** 2 + matrix[i, k].imag ** 2
            if value > largest:
                at, largest = i, value
        rows[k] = at
        if at != k:
            for j in range(size):
                matrix[k, j], matrix[at, j] = matrix[at, j], matrix[k, j]
        eliminate(matrix, k, size)
    for k in range(size - 1, -1, -1):
        if rows[k] != k:
            for i in range(size):
                matrix[i, k], matrix[i, rows[k]] = matrix[i, rows[k]], matrix[i, k]


@njit(cache=True)
def responses(omega, memory, stiffness, mass, damping, cosine, sine, free):  # type: ignore[no-untyped-def]
    """Eq. (1) at (n,) rad/s for W (n, 6, 6), (n, 6, 6); zero for degrees of freedom that are not among `free`."""
    count, size = len(omega), len(free)
    result = np.zeros((count, 6, 6), dtype=np.complex128)
    rates = np.empty((6, 6), dtype=np.complex128)
    matrix = np.empty((6, 6), dtype=np.complex128)
    for n in range(count):
        rates[:] = memory[n]
        for j in range(6):
            first, second = rates[0, j], rates[1, j]
            rates[0, j], rates[1, j] = cosine * first - sine * second, sine * first + cosine * second
        for i in range(6):
            first, second = rates[i, 0], rates[i, 1]
            rates[i, 0], rates[i, 1] = cosine * first - sine * second, sine * first + cosine * second
        for a in range(size):
            for b in range(size):
                i, j = free[a], free[b]
                rate = rates[i, j] + damping[i, j]
                matrix[a, b] = stiffness[i, j] + omega[n] * (1j * rate - omega[n] * mass[i, j])
        _invert(matrix, size)
        for a in range(size):
            for b in range(size):
                result[n, free[a], free[b]] = matrix[a, b]
    return result


@njit(cache=True)
def interpolated(values, place, rounding):  # type: ignore[no-untyped-def]
    """Matrices (n, k, k) linear between those (m, k, k) of whole numbers, at `place` (n,); zero outside of these."""
    count, size = len(values), values.shape[1]
    result = np.zeros((len(place), size, size), dtype=np.complex128)
    for n in range(len(place)):
        if -rounding <= place[n] <= count - 1 + rounding:
            cell = min(max(int(np.floor(place[n])), 0), count - 2)
            share = place[n] - cell
            for i in range(size):
                for j in range(size):
                    result[n, i, j] = (1.0 - share) * values[cell, i, j] + share * values[cell + 1, i, j]
    return result


@njit(cache=True)
def _any(matrix):  # type: ignore[no-untyped-def]
    """Whether there is anything in a matrix; spectra end, and beyond them there is nothing."""
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            if matrix[i, j] != 0.0:
                return True
    return False


@njit(cache=True)
def responding(cross, response):  # type: ignore[no-untyped-def]
    """S_y of eq. (2), (n, k, k), for Hermitian S_z (n, k, k) and H (n, 6, 6)."""
    size = cross.shape[1]
    result = np.zeros_like(cross)
    half = np.empty((6, size), dtype=np.complex128)
    for n in range(len(cross)):
        if not _any(cross[n]):
            continue
        for i in range(6):
            for j in range(size):
                half[i, j] = 0.0
            for k in range(6):
                factor = response[n, i, k]
                for j in range(size):
                    half[i, j] += factor * cross[n, k, j]
        for i in range(6):
            for j in range(i, 6):
                total = 0.0j
                for k in range(6):
                    total += half[i, k] * np.conj(response[n, j, k])
                result[n, i, j] = total
                result[n, j, i] = np.conj(total)
            for j in range(6, size):
                result[n, i, j] = half[i, j]
                result[n, j, i] = np.conj(half[i, j])
        for i in range(6, size):
            for j in range(6, size):
                result[n, i, j] = cross[n, i, j]
    return result


@njit(cache=True)
def powers_of_responding(cross, response):  # type: ignore[no-untyped-def]
    """Diagonals (n, 6) of S_y of eq. (2) for Hermitian S_z (n, k, k), k of six or more, and H (n, 6, 6)."""
    result = np.zeros((len(cross), 6))
    for n in range(len(cross)):
        if not _any(cross[n]):
            continue
        for i in range(6):
            for k in range(6):
                total = 0.0j
                for j in range(k):
                    total += cross[n, k, j] * np.conj(response[n, i, j])
                own = response[n, i, k]
                both = own * (2.0 * total + cross[n, k, k].real * np.conj(own))
                result[n, i] += both.real
    return result


@njit(cache=True)
def summed_over_diagonals(matrices, size, anti):  # type: ignore[no-untyped-def]
    """Sums of M_i M_j* of matrices (q, N, N), N a multiple of `size`, over a - b >= 0, or a + b if `anti`.

    a and b are the places in each block of `size` rows and columns. Shape (size, q, q), or (2 size - 1, q, q).
    """
    quantities, count = matrices.shape[0], matrices.shape[1]
    result = np.zeros((2 * size - 1 if anti else size, quantities, quantities), dtype=np.complex128)
    entry = np.empty(quantities, dtype=np.complex128)
    for m in range(count):
        a = m % size
        for n in range(count):
            b = n % size
            if not anti and b > a:
                continue
            at = a + b if anti else a - b
            for i in range(quantities):
                entry[i] = matrices[i, m, n]
            for i in range(quantities):
                for j in range(i, quantities):
                    result[at, i, j] += entry[i] * np.conj(entry[j])
    for i in range(quantities):
        for j in range(i):
            result[:, i, j] = np.conj(result[:, j, i])
    return result


@njit(cache=True)
def traces(forms, first, second):  # type: ignore[no-untyped-def]
    """tr(A_i H A_j^T G^T) of each pair of forms A (q, d, e), (q, q, n), for G (d, d, n) and H (e, e, n)."""
    quantities, rows, columns = forms.shape
    count = first.shape[2]
    result = np.zeros((quantities, quantities, count))
    before = np.empty((quantities, rows, columns, _CHUNK))
    after = np.empty((quantities, rows, columns, _CHUNK))
    for start in range(0, count, _CHUNK):
        size = min(_CHUNK, count - start)
        before[:] = 0.0
        after[:] = 0.0
        for i in range(quantities):
            for a in range(rows):
                for b in range(columns):
                    factor = forms[i, a, b]
                    if factor == 0.0:
                        continue
                    for c in range(columns):
                        source, target = second[b, c, start : start + size], before[i, a, c]
                        for n in range(size):
                            target[n] += factor * source[n]
                    for c in range(rows):
                        source, target = first[c, a, start : start + size], after[i, c, b]
                        for n in range(size):
                            target[n] += factor * source[n]
        for i in range(quantities):
            for j in range(quantities):
                total = result[i, j, start : start + size]
                for a in range(rows):
                    for c in range(columns):
                        one, other = before[i, a, c], after[j, a, c]
                        for n in range(size):
                            total[n] += one[n] * other[n]
    return result


@njit(cache=True)
def from_real_products(rr, ri, ii):  # type: ignore[no-untyped-def]
    """g^T A g* and g^T A g, (q, N, N), from Re g^T A Re g, Re g^T A Im g and Im g^T A Im g, (N, q, N), A symmetric."""
    size, quantities, _ = rr.shape
    hermitian = np.empty((quantities, size, size), dtype=np.complex128)
    symmetric = np.empty((quantities, size, size), dtype=np.complex128)
    for i in range(quantities):
        for m in range(size):
            for n in range(size):
                real, imaginary = rr[m, i, n], ii[m, i, n]
                here, turned = ri[m, i, n], ri[n, i, m]
                hermitian[i, m, n] = complex(real + imaginary, turned - here)
                symmetric[i, m, n] = complex(real - imaginary, turned + here)
    return hermitian, symmetric
