"""The two streams of the command line: results on standard output; progress, notes, warnings and errors on the other.

What a command is asked for goes to `output`, and what it says besides to `messages`; both fall silent in a quiet
command. Warnings and errors go through `complain`, which is heard in any case.
"""

from __future__ import annotations

import os
import sys
from contextlib import suppress

from rich.console import Console

_UNLIMITED = 1000  # columns


class _Messages(Console):
    """Standard error, of which nobody needs to read the end: a run is worth more than its progress."""

    def on_broken_pipe(self) -> None:
        """Go on without a reader."""
        self.quiet = True


def _width() -> int | None:
    """Of standard output: as wide as it takes where no terminal limits it, so that no line of a table is broken."""
    limited = os.environ.get("COLUMNS") or (sys.stdout is not None and sys.stdout.isatty())
    return None if limited else _UNLIMITED


output = Console(highlight=False, emoji=False, width=_width())
messages = _Messages(stderr=True, highlight=False, emoji=False)


def hush() -> None:
    """Show no more than warnings and errors."""
    output.quiet = messages.quiet = True


def unhush() -> None:
    """Show everything again."""
    output.quiet = messages.quiet = False


def say(text: object, aside: bool = False) -> None:
    """Print a line as it is, however long; `aside` puts it on standard error, out of the way of JSON."""
    (messages if aside else output).print(str(text), markup=False, soft_wrap=True)


def complain(text: str) -> None:
    """Print a warning or an error on standard error, whether the command is quiet or not."""
    with suppress(OSError):  # of a reader that is gone
        print(text, file=sys.stderr, flush=True)  # which is above the bar, where there is one
