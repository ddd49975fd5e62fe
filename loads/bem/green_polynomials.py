"""Tables of polynomials evaluated eight at a time, the look-up behind the free-surface Green function.

    f_l(x, y) = sum_ij c[i, j, l] x^i y^j,   l = 0..7,   -1 <= x, y <= 1                                           (1)

A look-up costs as much as its multiplications, and a compiler does not vectorize Horner's rule over eight polynomials
by itself; `tensor_lanes` therefore states the vector operations, one multiply-add on eight numbers for each i and j. A
pair of polynomials of higher degree uses the lanes as Estrin's scheme does, with four blocks of powers of each.

The look-up takes the address of a table rather than the array: compiled code counts the references of every array in a
record that it hands on, by atomic operations that take several times as long as the look-up itself.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

LANES = 8
ALIGNMENT = 64  # bytes: eight numbers are one line of the cache
BLOCKS = 4  # of powers, in the lanes of a pair of polynomials
# Not "nnan" and "ninf": a point out of range must give what it gives.
FAST = {"contract", "reassoc", "arcp"}


def power_basis(terms: int) -> tuple[FloatArray, FloatArray]:
    """Chebyshev nodes on -1..1, `terms` of them, and the matrix from values there to coefficients of powers."""
    nodes = chebyshev.chebpts1(terms)
    to_chebyshev = np.linalg.inv(chebyshev.chebvander(nodes, terms - 1))
    to_powers = np.zeros((terms, terms))
    for order in range(terms):
        powers = chebyshev.cheb2poly(np.eye(terms)[order])
        to_powers[: len(powers), order] = powers
    return nodes, to_powers @ to_chebyshev


def aligned(values: FloatArray) -> FloatArray:
    """Read-only contiguous copy that starts at a multiple of 64 bytes, as `tensor_lanes` asks."""
    room = np.empty(values.size + LANES)
    start = (-room.ctypes.data % ALIGNMENT) // room.itemsize
    copy = room[start : start + values.size].reshape(values.shape)
    copy[...] = values
    copy.setflags(write=False)
    return copy


def address(values: FloatArray) -> int:
    """Address of the first number of an array."""
    return int(values.ctypes.data)


def pair_blocks(powers: FloatArray) -> FloatArray:
    """Lay out pairs of polynomials for `tensor_lanes`, four blocks of powers of the last variable each.

    Parameters
    ----------
    powers
        Coefficients, shape (cells, 2, rows, 4 columns): powers of x, then of y.

    Returns
    -------
    Shape (cells, rows columns 8); the lanes hold, for the first polynomial and then for the second, the factors of
    1, y^columns, y^(2 columns), y^(3 columns).
    """
    cells, pair, rows, terms = powers.shape
    columns = terms // BLOCKS
    blocks = powers.reshape(cells, pair, rows, BLOCKS, columns)
    return aligned(blocks.transpose(0, 2, 4, 1, 3).reshape(cells, rows * columns * LANES))


def tensor_lanes(rows: int, columns: int) -> Callable[..., Any]:
    """Make the compiled look-up (address, cell, x, y) -> eight values by eq. (1).

    Parameters
    ----------
    rows, columns
        Number of powers of x and of y.

    Returns
    -------
    Callable from compiled code only. The address is that of an `aligned` array of shape (cells, rows columns 8), which
    the caller keeps alive; `cell` is not checked.
    """

    @intrinsic
    def look_up(typing_context: Any, address: Any, cell: Any, x: Any, y: Any) -> Any:
        result = types.UniTuple(types.float64, LANES)

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            vector = ir.VectorType(ir.DoubleType(), LANES)
            offset = builder.mul(arguments[1], ir.Constant(arguments[1].type, rows * columns * LANES * 8))
            start = builder.inttoptr(builder.add(arguments[0], offset), vector.as_pointer())

            def spread(value: Any) -> Any:
                empty = ir.Constant(vector, ir.Undefined)
                first = builder.insert_element(empty, value, ir.Constant(ir.IntType(32), 0))
                mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
                return builder.shuffle_vector(first, empty, mask)

            def load(term: int) -> Any:
                loaded = builder.load(builder.gep(start, [ir.Constant(ir.IntType(64), term)]))
                loaded.align = ALIGNMENT
                return loaded

            def horner(terms: list[Any], variable: Any) -> Any:
                value = terms[-1]
                for term in reversed(terms[:-1]):
                    product = builder.fmul(value, variable, flags=("contract",))
                    value = builder.fadd(product, term, flags=("contract",))
                return value

            across, along = spread(arguments[2]), spread(arguments[3])
            inner = [horner([load(i * columns + j) for j in range(columns)], along) for i in range(rows)]
            value = horner(inner, across)
            lanes = [builder.extract_element(value, ir.Constant(ir.IntType(32), lane)) for lane in range(LANES)]
            return cgutils.pack_array(builder, lanes)

        return result(types.intp, types.intp, types.float64, types.float64), generate

    return look_up
