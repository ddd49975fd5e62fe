"""Components made of Python functions that end badly in the step that begins at 0.3 s; see `component`."""

import ctypes
import functools
import os
import subprocess
import sys
import time
from collections.abc import Callable

from tlpsim.loads.errors import DiscardError
from tlpsim.orchestrator.instance import PythonInstance, Values


def _raise(error: Exception) -> None:
    raise error


def _crash() -> None:
    print("about to read at 0", file=sys.stderr)
    ctypes.string_at(0)


def _hang_with_a_helper() -> None:
    subprocess.Popen(["sleep", "987654"])
    time.sleep(1000.0)


MISBEHAVIOURS: dict[str, Callable[[], object]] = {
    "none": lambda: None,
    "crash": _crash,
    "hang": lambda: time.sleep(1000.0),
    "hang with a helper": _hang_with_a_helper,
    "exit": lambda: os._exit(7),
    "sys.exit": lambda: sys.exit(5),
    "exception": lambda: _raise(ZeroDivisionError("float division by zero")),
    "discard": lambda: _raise(DiscardError("hull: the step of 0.1 s at t = 0.3 s is discarded")),
    "print": lambda: print("a line for people"),
}


def _step(misbehaviour: str, values: Values, time: float, size: float) -> None:
    if time >= 0.3 - 1e-9:
        MISBEHAVIOURS[misbehaviour]()
    values["x"] += size * (values["u"] - values["x"])
    values["process"] = float(os.getpid())


def _initialize(values: Values, time: float) -> None:
    values["process"] = float(os.getpid())


def component(misbehaviour: str = "none") -> PythonInstance:
    """x' = u - x by the forward Euler method, with the number of its process as another output."""
    return PythonInstance(
        "hull",
        functools.partial(_step, misbehaviour),
        inputs={"u": 1.0},
        outputs={"x": 0.0, "process": 0.0},
        initialize=_initialize,
        units={"x": "m"},
    )


def broken() -> PythonInstance:
    """Fail only in the process of the component."""
    if os.environ.get("TMPDIR", "").rpartition("/")[2].startswith("tlpsim_isolated_"):
        raise RuntimeError("no licence")
    return component()
