"""Errors of the library: each derives from `FrictionError`, keeps its details as attributes and reads as one line."""

from __future__ import annotations

import contextlib
import copyreg
import pickle
import reprlib
from collections.abc import Iterator, Mapping
from typing import Any

WIDTH = 80
"""Characters of a bad value that a message shows."""

LONGEST = 300
"""Characters of a message about a file."""

_BRIEF = reprlib.Repr()
_BRIEF.maxlist = _BRIEF.maxtuple = _BRIEF.maxset = _BRIEF.maxfrozenset = (
    _BRIEF.maxdict
) = _BRIEF.maxarray = 12
_BRIEF.maxstring = _BRIEF.maxlong = _BRIEF.maxother = 2 * WIDTH


def shown(value: Any) -> str:
    """Return `value` for a message: on one line, cut to `WIDTH` characters; texts without quotes."""
    try:
        text = (
            value
            if isinstance(value, str) and value.isprintable()
            else _BRIEF.repr(value)
        )
    except Exception:  # what cannot be printed, such as integers of more than 4300 digits, is still named
        text = f"{type(value).__name__} that is too long to show"
    line = " ".join(text[: 4 * WIDTH].split())
    return line if len(line) <= WIDTH else f"{line[: WIDTH - 3]}..."


def one_line(message: str) -> str:
    """Return `message` without what cannot be printed, and without its middle where it is longer than `LONGEST`."""
    if not message.isprintable():
        message = "".join(
            each if each.isprintable() else ascii(each)[1:-1] for each in message
        )
    return (
        message
        if len(message) <= LONGEST
        else f"{message[: LONGEST // 2 - 5]} ... {message[-LONGEST // 2 :]}"
    )


class _Travels:
    """Errors go through pickles, and so between processes, with their attributes."""

    def __reduce__(self) -> tuple[Any, ...]:
        # By default an error is restored from its message alone, which these constructors do not take.
        kept = {
            name: value if _can_travel(value) else None
            for name, value in self.__dict__.items()
        }
        return copyreg.__newobj__, (type(self), *self.args), kept  # pyright: ignore[reportAttributeAccessIssue]


def _can_travel(value: Any) -> bool:
    try:
        pickle.dumps(value)
    except Exception:  # a lambda, an open file: its own pickling may fail with anything
        return False
    return True


class FrictionError(_Travels, Exception):
    """Base class of every error that planarfriction raises on purpose.

    Errors can be copied and pickled; an attribute that cannot be pickled becomes None, and the message stays the same.
    """


class InvalidValueError(FrictionError, ValueError):
    """A parameter breaks its rule: `mu_s must be >= mu_c, got mu_s=0.3, mu_c=0.5`.

    Its attributes are the `name` of the parameter as the caller wrote it, the `rule`, which continues the sentence
    "<name> must ...", and the `value` or a text that describes it; the message shows its first 80 characters.
    """

    def __init__(self, name: str, rule: str, value: Any):
        self.name = name
        self.rule = rule
        self.value = value
        super().__init__(f"{name} must {rule}, got {shown(value)}")


class FileError(FrictionError, OSError):
    """A file is missing, of the wrong kind, or cannot be written; the message names the file and what to do."""

    def __str__(self) -> str:
        return one_line(super().__str__())  # names of files may hold anything


class MissingExtraError(FrictionError, ImportError):
    """An optional package is not installed; the message names the extra that installs it."""

    def __init__(self, package: str, extra: str):
        self.package = package
        self.extra = extra
        alone = "; for the processor alone, first pip install torch --index-url https://download.pytorch.org/whl/cpu"
        more = alone if extra == "torch" else ""
        super().__init__(
            f"{package} is not installed: run pip install 'planarfriction[{extra}]'{more}"
        )


@contextlib.contextmanager
def needing(package: str, extra: str) -> Iterator[None]:
    """Raise MissingExtraError where an import in the block lacks a package: `package` is what `extra` brings."""
    try:
        yield
    except ImportError as error:
        if (error.name or "").startswith("planarfriction"):
            raise
        raise MissingExtraError(package, extra) from None


class SolverError(FrictionError, RuntimeError):
    """The solver failed; the message suggests a remedy.

    Its attribute `solution` is the `Solution` up to the failure, or None. From `SlidingBody.step`, `step` is the
    `BodyStep` of all bodies and `converged` `[...]` is True for those whose results hold; both are None elsewhere.
    """

    def __init__(
        self,
        message: str,
        solution: Any = None,
        step: Any = None,
        converged: Any = None,
    ):
        self.solution = solution
        self.step = step
        self.converged = converged
        super().__init__(message)


class SimulationInterrupted(_Travels, KeyboardInterrupt):
    """Ctrl-C during a simulation; `solution` holds everything computed so far."""

    def __init__(self, solution: Any):
        self.solution = solution
        super().__init__("simulation interrupted")


class IdentificationInterrupted(_Travels, KeyboardInterrupt):
    """Ctrl-C during an identification; `estimates` holds the best values so far by name [SI], which have no errors."""

    def __init__(self, estimates: Mapping[str, float]):
        self.estimates = dict(estimates)
        found = ", ".join(
            f"{name} = {value:.4g}" for name, value in self.estimates.items()
        )
        super().__init__(
            f"identification interrupted, not finished; best so far, without intervals [SI]: {found}"
        )


class SweepError(FrictionError, RuntimeError):
    """A sweep ended early, or none of its runs succeeded."""


class SweepInterrupted(_Travels, KeyboardInterrupt):
    """Ctrl-C during a sweep; `data` is the dataset of the finished runs, with the status "missing" for the others."""

    def __init__(self, message: str, data: Any):
        self.data = data
        super().__init__(f"sweep interrupted: {message}")
