"""Log messages of FMUs: which instance they come from, and which of them tells why a call failed."""

import itertools
from collections import deque
from collections.abc import Callable

STATUS_NAMES = {0: "ok", 1: "warning", 2: "discard", 3: "error", 4: "fatal", 5: "pending"}
"""Of FMI 2.0; FMI 3.0 has no pending."""

_LENGTH = 64
_numbers = itertools.count(1)
_open_logs: dict[int, "Log"] = {}
_followers: list[Callable[[str], None]] = []


def log_of(environment: int | None) -> "Log | None":
    """Log of an instance by the number that its FMU was given as its environment."""
    return _open_logs.get(environment or 0)


def follow(tell: Callable[[str], None]) -> None:
    """Call a function with every message of an FMU from now on, as it comes."""
    _followers.append(tell)


def _line(time: float | None, status: int, text: str) -> str:
    return f"{'' if time is None else f't = {time:.9g} s, '}{STATUS_NAMES.get(status, status)}: {text}"


def _readable(message: bytes | None) -> str:
    """Reduce a log message to one line; of a Python traceback the last line tells what went wrong."""
    text = (message or b"").decode("utf-8", errors="replace")
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else ""


class Log:
    """The newest messages of one instance.

    Attributes
    ----------
    number
        The instance's number, its environment in the terms of FMI.
    time
        Time in s of the step that the instance is in; that of the master's clock where there is one.
    clock
        Function of the master, for steps of the compiled loop.
    muted
        Whether messages are dropped.
    """

    def __init__(self) -> None:
        self.number = next(_numbers)
        self._time = 0.0
        self.clock: Callable[[], float] | None = None
        self.muted = False
        self._entries: deque[tuple[float, int, str]] = deque(maxlen=_LENGTH)

    @property
    def time(self) -> float:
        """See above."""
        return self.clock() if self.clock is not None else self._time

    @time.setter
    def time(self, value: float) -> None:
        self._time = value

    def open(self) -> None:
        """Take messages from now on."""
        _open_logs[self.number] = self

    def close(self) -> None:
        """Take no messages any more."""
        _open_logs.pop(self.number, None)

    def add(self, status: int, message: bytes | None) -> None:
        """File a message of the FMU."""
        if self.muted:
            return
        text = _readable(message)
        self._entries.append((self.time, status, text))
        for tell in _followers:
            tell(_line(self.time, status, text))

    def add_warning(self, function: str) -> None:
        """File that a function returned warning, unless the FMU itself said so in this step."""
        if not any(time == self.time and status == 1 for time, status, _ in self._entries):
            self._entries.append((self.time, 1, f"{function} returned warning"))

    def texts(self) -> tuple[str, ...]:
        """All messages, oldest first, one line each."""
        return tuple(_line(*entry) for entry in self._entries)

    def cause(self) -> str:
        """The gravest message of the current step (the newest such) after a colon, or nothing."""
        current = [(status, text) for time, status, text in self._entries if time == self.time]
        if not current:
            return ""
        gravest = max(status for status, _ in current)
        return next(f": {text}" for status, text in reversed(current) if status == gravest)
