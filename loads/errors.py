"""The errors that tlpsim raises: one root, one class for each kind of cause.

A message says what is wrong, where, the value, the limit and the way out, on one line.
"""


class TlpsimError(Exception):
    """Root of all errors that tlpsim raises on purpose."""


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
