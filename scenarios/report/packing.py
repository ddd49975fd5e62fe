"""Arrays as text in a page: 16 bits a value, differences, deflate, base64; `assets/unpack.js` reads them back.

A value x becomes the whole number

    q = round((x - offset) / scale),   0 <= q <= 65534,   65535 where x is not a finite number         (1)

so that it is read back within half a `scale`, which is 1/65534 of the array's range. Signals are smooth between
samples: the differences of some order k, modulo 2^16, are small. They are folded, 0, -1, 1, -2, ... -> 0, 1, 2, 3, ...,
so that their upper bytes are mostly zero; all lower bytes follow all upper bytes, deflated (zlib's format, RFC 1950).
That order is taken which needs the fewest bits by the sum of log2(1 + |difference|).
"""

import base64
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

LARGEST = 65534
"""Of the whole numbers of eq. (1)."""

_MISSING = 65535
_MOST_DIFFERENCES = 4
_LEVEL = 6  # of deflate; beyond it the text shrinks by less than a hundredth


def pack(values: NDArray[np.floating[Any]]) -> dict[str, Any]:
    """An array for a page, as what JSON can hold; `unpack` of `assets/unpack.js` gives it back as Float32Array.

    Parameters
    ----------
    values
        Any shape, values within the range of single precision; it is packed flat, in C order. Pack a component of a
        vector by itself, since the differences are those of neighbours. What is not finite is read back as NaN.

    Returns
    -------
    ``count``, ``offset``, ``scale`` and ``differences`` (the order k) as numbers, ``data`` as text; eq. (1).
    """
    flat = np.asarray(values, dtype=np.float64).ravel()
    finite = np.isfinite(flat)
    lowest = float(flat[finite].min()) if finite.any() else 0.0
    highest = float(flat[finite].max()) if finite.any() else 0.0
    scale = (highest - lowest) / LARGEST or 1.0
    with np.errstate(invalid="ignore"):
        whole = np.clip(np.rint(flat / scale - lowest / scale), 0, LARGEST)
    coded = np.where(finite, whole, _MISSING).astype(np.uint16)
    order, folded = _folded_differences(coded)
    return {
        "count": len(flat),
        "offset": lowest,
        "scale": scale,
        "differences": order,
        "data": deflated(np.concatenate([(folded >> 8).astype(np.uint8), folded.astype(np.uint8)]).tobytes()),
    }


def pack_times(times: NDArray[np.float64]) -> dict[str, Any]:
    """Times in s for a page: ``count``, ``start`` and ``step`` where they are even, else ``data`` with doubles."""
    count = len(times)
    start = float(times[0]) if count else 0.0
    step = float(times[-1] - times[0]) / (count - 1) if count > 1 else 0.0
    if np.allclose(times, start + step * np.arange(count), rtol=0.0, atol=1e-6 * step):
        return {"count": count, "start": start, "step": step}
    return {"count": count, "data": deflated(times.astype("<f8").tobytes())}


def deflated(content: bytes) -> str:
    """Bytes as base64 of their zlib stream."""
    return base64.b64encode(zlib.compress(content, _LEVEL)).decode("ascii")


def _folded_differences(coded: NDArray[np.uint16]) -> tuple[int, NDArray[np.uint16]]:
    """Order of the differences that need the fewest bits, and they, folded."""
    best, cost = (0, coded), np.inf
    differences = coded
    for order in range(_MOST_DIFFERENCES + 1):
        if order:
            differences = np.diff(differences, prepend=np.uint16(0))  # modulo 2^16, as unsigned numbers are
        signed = differences.view(np.int16).astype(np.int32)
        bits = float(np.sum(np.log2(1.0 + np.abs(signed))))
        if bits < cost:
            best, cost = (order, ((signed << 1) ^ (signed >> 15)).astype(np.uint16)), bits
    return best
