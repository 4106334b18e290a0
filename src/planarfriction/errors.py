"""Errors of the library: each derives from `FrictionError`, carries its facts as attributes and reads as one line."""

from __future__ import annotations

from typing import Any


class FrictionError(Exception):
    """Base of every error that planarfriction raises on purpose."""


class InvalidValueError(FrictionError, ValueError):
    """A parameter breaks its rule: `mu_s must be >= mu_c, got mu_s=0.3, mu_c=0.5`.

    Attributes
    ----------
    name
        Name of the parameter as the caller wrote it.
    rule
        The rule it breaks, continuing the sentence "<name> must ...".
    value
        The offending value, or the text that describes it.
    """

    def __init__(self, name: str, rule: str, value: Any):
        self.name, self.rule, self.value = name, rule, value
        shown = value if isinstance(value, str) else repr(value)
        super().__init__(f"{name} must {rule}, got {shown}")


class FileError(FrictionError, OSError):
    """A file is missing, of the wrong kind, or cannot be written: says which file and what to do."""


class MissingExtraError(FrictionError, ImportError):
    """An optional package is not installed: names the extra that installs it."""

    def __init__(self, package: str, extra: str):
        self.package, self.extra = package, extra
        super().__init__(f"{package} is not installed: run pip install 'planarfriction[{extra}]'")


class SolverError(FrictionError, RuntimeError):
    """The solver gave up; the message says the remedy.

    Attributes
    ----------
    solution
        What was computed up to the failure (a `Solution`), or None.
    """

    def __init__(self, message: str, solution: Any = None):
        self.solution = solution
        super().__init__(message)


class SimulationInterrupted(KeyboardInterrupt):
    """Ctrl-C during a simulation; `solution` holds everything computed so far."""

    def __init__(self, solution: Any):
        self.solution = solution
        super().__init__("simulation interrupted")
