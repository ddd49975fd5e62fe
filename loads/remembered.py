"""Results of functions of arrays, kept by the content of the arguments: what many cases share is computed once.

A result found again is that of an earlier call with the very same values: nothing depends on the calls before.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

Result = TypeVar("Result")


class _Content(NamedTuple):
    """Shape, type and values of an array, as a key."""

    shape: tuple[int, ...]
    kind: str
    values: bytes


def remembered(most: int) -> Callable[[Callable[..., Result]], Callable[..., Result]]:
    """Decorate a pure function of arrays and hashable values so that its last `most` results are kept.

    The arrays among its results, alone or in a tuple, are read-only.
    """

    def decorated(function: Callable[..., Result]) -> Callable[..., Result]:
        @lru_cache(maxsize=most)
        def of_content(*arguments: Any) -> Result:
            result = function(*map(_restored, arguments))
            for each in result if isinstance(result, tuple) else (result,):
                if isinstance(each, np.ndarray):
                    each.flags.writeable = False
            return result

        @wraps(function)
        def found(*arguments: Any) -> Result:
            return of_content(*map(_key, arguments))

        return found

    return decorated


def _key(argument: Any) -> Any:
    if isinstance(argument, np.ndarray):
        return _Content(argument.shape, argument.dtype.str, argument.tobytes())
    return argument


def _restored(key: Any) -> Any:
    if isinstance(key, _Content):
        values: NDArray[Any] = np.frombuffer(key.values, dtype=key.kind).reshape(key.shape)
        return values
    return key
