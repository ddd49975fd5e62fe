"""Fits of digital filters that this process has made or was given, by all that they depend on.

A fit takes some tenths of a second, and several components, or runs that differ in their seeds, need the same one. It
is made once in a process (`known_fit`); `fits_used` and `learn` carry it to others.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import contextmanager

from tlpsim.loads.filters.arma import Fit

MOST = 256
"""Fits that a process keeps, those that were used last."""

_fits: OrderedDict[Hashable, Fit] = OrderedDict()
_recorders: list[dict[Hashable, Fit]] = []
_lock = threading.Lock()


def known_fit(key: Hashable, make: Callable[[], Fit]) -> Fit:
    """The fit of a key, made where it is not known.

    Parameters
    ----------
    key
        All that the fit depends on, and a name that no other kind of fit has.
    make
        Makes the fit; what it raises is raised here, and nothing is kept.
    """
    with _lock:
        fitted = _fits.get(key)
    if fitted is None:
        fitted = make()
    learn({key: fitted})
    with _lock:
        for recorder in _recorders:
            recorder[key] = fitted
    return fitted


def learn(fits: Mapping[Hashable, Fit]) -> None:
    """Know fits that another process made."""
    with _lock:
        for key, fitted in fits.items():
            _fits[key] = fitted
            _fits.move_to_end(key)
        while len(_fits) > MOST:
            _fits.popitem(last=False)


@contextmanager
def fits_used() -> Iterator[dict[Hashable, Fit]]:
    """The fits that are asked for while the block lasts, by key; for `learn` in another process."""
    recorder: dict[Hashable, Fit] = {}
    with _lock:
        _recorders.append(recorder)
    try:
        yield recorder
    finally:
        with _lock:
            _recorders[:] = [each for each in _recorders if each is not recorder]
