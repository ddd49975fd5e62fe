"""How a command of `tlpsim` ends: its exit code, and its last line on the error stream.

An error that tlpsim raised on purpose is bad input or a run that failed; so is what the machine refuses: a file that
cannot be read or written, memory. Any other exception is a bug, which is told in one line, too. With the environment
variable `TLPSIM_DEBUG` set, the traceback comes before it.
"""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import IntEnum

import typer

from tlpsim.loads.errors import TlpsimError
from tlpsim.scenarios.bugs import bug_text
from tlpsim.scenarios.interruption import Terminated
from tlpsim.scenarios.terminal import complain

DEBUG = "TLPSIM_DEBUG"


class ExitCode(IntEnum):
    """Exit codes of `tlpsim`; those from 128 on are 128 and the number of a signal."""

    DONE = 0
    NO = 1  # the answer to what was asked, as whether an FMU fits
    ERROR = 2  # bad input, or a run that failed
    BUG = 70  # of sysexits.h: internal software error
    INTERRUPTED = 130
    NO_READER = 141
    TERMINATED = 143


@contextmanager
def interruptible(remains: Callable[[], str]) -> Iterator[None]:
    """On Ctrl-C or SIGTERM, tell so with what remains of the work, and leave with the exit code of that signal."""
    try:
        yield
    except KeyboardInterrupt as reason:
        complain(f"tlpsim: {_word(reason)}; {remains()}")
        raise typer.Exit(_code(reason)) from None


def last_words(error: BaseException) -> ExitCode:
    """Tell in one line why a command ends, and give its exit code."""
    if os.environ.get(DEBUG):
        complain("".join(traceback.format_exception(error)).rstrip())
    if isinstance(error, KeyboardInterrupt):
        complain(f"tlpsim: {_word(error)}")
        return _code(error)
    text, code = _cause(error)
    complain(f"tlpsim: {text}")
    return code


def _cause(error: BaseException) -> tuple[str, ExitCode]:
    said = " ".join(str(error).split())
    if isinstance(error, TlpsimError):
        return f"error: {said}", ExitCode.ERROR
    if isinstance(error, MemoryError):
        return f"error: not enough memory{f': {said}' if said else ''}", ExitCode.ERROR
    if isinstance(error, OSError) and error.strerror:
        where = f"{error.filename}: " if error.filename is not None else ""
        return f"error: {where}{error.strerror[0].lower()}{error.strerror[1:]}", ExitCode.ERROR
    return f"{bug_text(error)}; run it again with {DEBUG}=1 for the traceback, and report it", ExitCode.BUG


def ended_by(end: SystemExit) -> int:
    """Exit code of a command that ended by itself; rich and typer end by 1 where nobody reads their output."""
    if isinstance(end.__context__, BrokenPipeError):
        return ExitCode.NO_READER
    if end.code is None or isinstance(end.code, int):
        return end.code or ExitCode.DONE
    print(end.code, file=sys.stderr)
    return ExitCode.NO


def _word(reason: KeyboardInterrupt) -> str:
    return "terminated" if isinstance(reason, Terminated) else "interrupted"


def _code(reason: KeyboardInterrupt) -> ExitCode:
    return ExitCode.TERMINATED if isinstance(reason, Terminated) else ExitCode.INTERRUPTED
