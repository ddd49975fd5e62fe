"""The errors that tlpsim raises: one root, one class for each kind of cause.

A message says what is wrong, where, the value, the limit and the way out, on one line.
"""

import re

_LINE_BREAKS = re.compile(r"\s*[\t\n\v\f\r\x1c-\x1e\x85\u2028\u2029]\s*")
_LONGEST, _END = 2000, 600  # characters of a message, and of its end where the middle is left out


class TlpsimError(Exception):
    """Root of all errors that tlpsim raises on purpose.

    The text is of one line and of 2000 characters at most, whatever it quotes.
    """

    def __str__(self) -> str:
        text = _LINE_BREAKS.sub(" ", super().__str__())
        if len(text) > _LONGEST:
            text = f"{text[: _LONGEST - _END - 5]} ... {text[-_END:]}"
        return text


class ScenarioError(TlpsimError):
    """A scenario, or a parameter record made from one, holds a bad key, value or unit."""


class WiringError(TlpsimError):
    """Components are connected by variables that do not exist or do not fit."""


class FmuError(TlpsimError):
    """An FMU cannot be read, built, loaded or initialized."""


class StepError(TlpsimError):
    """A component failed in a step, or gave a value that is not a finite number."""


class DiscardError(StepError):
    """A component computed none or only a part of a step, and says so; a smaller step may go."""


class SolverError(TlpsimError):
    """A numerical method did not converge or was given an ill-posed problem."""
