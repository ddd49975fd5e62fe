"""Ctrl-C and SIGTERM: an exception for each, and a way to be told of them where an exception would do harm."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class Terminated(KeyboardInterrupt):
    """The process was asked to end by SIGTERM: what ends in good order on Ctrl-C does so on this, too."""


_EXCEPTIONS: dict[int, tuple[type[KeyboardInterrupt], str]] = {
    signal.SIGINT: (KeyboardInterrupt, "interrupted by Ctrl-C"),
    signal.SIGTERM: (Terminated, "terminated by SIGTERM"),
}


@contextmanager
def interrupts_told(tell: Callable[[KeyboardInterrupt], None]) -> Iterator[None]:
    """Give a function the exception of Ctrl-C or SIGTERM, which it may raise, for as long as the block lasts.

    A signal that is ignored stays ignored, as Ctrl-C is in a command that a shell put into the background. Outside the
    main thread, to which signals come, nothing changes.
    """

    def handle(number: int, _: object) -> None:
        kind, text = _EXCEPTIONS[number]
        tell(kind(text))

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    present = {number: signal.getsignal(number) for number in _EXCEPTIONS}
    # None is a handler that is not of Python, and could not be put back.
    before = {number: handler for number, handler in present.items() if handler not in (signal.SIG_IGN, None)}
    for number in before:
        signal.signal(number, handle)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
