"""What is particular to FMUs made with pythonfmu (FMI 2.0) and PythonFMU3."""

import atexit
from typing import Any

from tlpsim.orchestrator.fmi.description import FmuDescription

_released_at_exit: set[int] = set()


def is_python_fmu(description: FmuDescription) -> bool:
    """Whether the FMU is made of Python.

    Its log messages are finished text and no printf formats, and those that tell the cause of a failure are in none of
    its log categories.
    """
    return "PythonFMU" in description.generation_tool


def release_state_at_exit(library: Any) -> None:
    """Keep the library of a Python FMU from releasing its state twice when the process ends; harmless for others.

    pythonfmu 0.7 releases it in a destructor of the library that runs after the C++ one, which now and then ends the
    process with a corrupted heap. Released before both, neither finds anything to do.

    Parameters
    ----------
    library
        The `ctypes.CDLL`.
    """
    release = getattr(library, "finalizePythonInterpreter", None)
    if release is not None and library._handle not in _released_at_exit:
        _released_at_exit.add(library._handle)
        atexit.register(release)
