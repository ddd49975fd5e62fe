"""Log messages of FMUs: which instance they come from, and which of them tells why a call failed."""

import itertools
import re
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

STATUS_NAMES = {0: "ok", 1: "warning", 2: "discard", 3: "error", 4: "fatal", 5: "pending"}
"""Of FMI 2.0; FMI 3.0 has no pending."""

_LENGTH = 64
_LINE = re.compile(rf"t = (\S+) s, ({'|'.join(STATUS_NAMES.values())}): (.*)")
_numbers = itertools.count(1)
_open_logs: dict[int, "Log"] = {}
_followers: list[Callable[["Message"], None]] = []


@dataclass(frozen=True, slots=True, kw_only=True)
class Message:
    """What an FMU said.

    Attributes
    ----------
    component
        Name of the instance.
    time
        Of the step in which it came, s.
    status
        See `STATUS_NAMES`; 1 and more are warnings and faults.
    text
        One line.
    """

    component: str
    time: float
    status: int
    text: str

    def __str__(self) -> str:
        return f"t = {self.time:.9g} s, {STATUS_NAMES.get(self.status, self.status)}: {self.text}"


def parsed(component: str, line: str) -> Message | None:
    """Message of a line that one was written to; None for any other line."""
    found = _LINE.fullmatch(line)
    if found is None:
        return None
    status = next(number for number, name in STATUS_NAMES.items() if name == found[2])
    return Message(component=component, time=float(found[1]), status=status, text=found[3])


def log_of(environment: int | None) -> "Log | None":
    """Log of an instance by the number that its FMU was given as its environment."""
    return _open_logs.get(environment or 0)


def follow(tell: Callable[[Message], None]) -> None:
    """Call a function with every message of an FMU from now on, as it comes."""
    _followers.append(tell)


def unfollow(tell: Callable[[Message], None]) -> None:
    """Call a function no more that was given to `follow`."""
    _followers.remove(tell)


def _readable(message: bytes | None) -> str:
    """Reduce a log message to one line; of a Python traceback the last line tells what went wrong."""
    text = (message or b"").decode("utf-8", errors="replace")
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else ""


class Log:
    """The newest messages of one instance.

    Parameters
    ----------
    component
        Name of the instance.

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

    def __init__(self, component: str = "") -> None:
        self._component = component
        self.number = next(_numbers)
        self._time = 0.0
        self.clock: Callable[[], float] | None = None
        self.muted = False
        self._entries: deque[Message] = deque(maxlen=_LENGTH)

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
        if not self.muted:
            self._file(status, _readable(message))

    def add_warning(self, function: str) -> None:
        """File that a function returned warning, unless the FMU itself said so in this step."""
        if not any(each.time == self.time and each.status == 1 for each in self._entries):
            self._file(1, f"{function} returned warning")

    def _file(self, status: int, text: str) -> None:
        message = Message(component=self._component, time=self.time, status=status, text=text)
        self._entries.append(message)
        for tell in _followers:
            tell(message)

    def texts(self) -> tuple[str, ...]:
        """All messages, oldest first, one line each."""
        return tuple(str(each) for each in self._entries)

    def cause(self) -> str:
        """The gravest message of the current step (the newest such) after a colon, or nothing."""
        current = [each for each in self._entries if each.time == self.time]
        if not current:
            return ""
        gravest = max(each.status for each in current)
        return next(f": {each.text}" for each in reversed(current) if each.status == gravest)
