"""The promise: a call works, or says in one line of its own what is wrong; it is quick, small, and compiles nothing."""

from __future__ import annotations

import collections
import contextlib
import re
import resource
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numba.core import event

from planarfriction import FrictionError

SECONDS = 30.0
"""A wrong argument is refused, or a right one used, in less time of the processor, whatever else runs on the machine.

The longest legal ones, scenes of a million samples, take a tenth of it.
"""

MEMORY = 1 << 30
"""Memory that a call may allocate [bytes]."""

LONGEST = 300
"""Characters of a message, besides the choices that it names."""

CASES: collections.Counter[str] = collections.Counter()
"""Number of cases judged, and of those refused, by kind."""


class Broken(AssertionError):
    """The promise does not hold."""


class _TooSlow(BaseException):
    """Raised inside a call that takes too long; no `except Exception` holds it."""


class _Compiles(event.Listener):
    """Remembers what Numba compiled (what it reads from its cache is not compiled)."""

    def __init__(self):
        self.names: list[str] = []

    def on_start(self, event):
        self.names.append(getattr(event.data["dispatcher"].py_func, "__name__", "?"))

    def on_end(self, event):
        pass


_COMPILES = _Compiles()
event.register("numba:compile", _COMPILES)


def _virtual_memory() -> int:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[0]) * resource.getpagesize()


@contextlib.contextmanager
def watched(seconds: float = SECONDS, memory: int = MEMORY) -> Iterator[None]:
    """Fail if what runs inside takes longer, or asks for more memory at once."""

    def too_slow(*_):
        raise _TooSlow

    limits = resource.getrlimit(resource.RLIMIT_AS)
    before = time.process_time()
    alarm = threading.current_thread() is threading.main_thread()
    with contextlib.suppress(OSError):
        resource.setrlimit(resource.RLIMIT_AS, (_virtual_memory() + memory, limits[1]))
    if alarm:
        former = signal.signal(signal.SIGPROF, too_slow)
        signal.setitimer(signal.ITIMER_PROF, 2.0 * seconds)
    try:
        yield
    except MemoryError:
        raise Broken(f"asks for more than {memory >> 20} MB") from None
    except _TooSlow:
        raise Broken(f"takes longer than {2.0 * seconds:g} s") from None
    finally:
        if alarm:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
            signal.signal(signal.SIGPROF, former)
        resource.setrlimit(resource.RLIMIT_AS, limits)
    if (took := time.process_time() - before) > seconds:
        raise Broken(f"takes {took:.1f} s")


def judge(
    kind: str,
    call: Callable[[], Any],
    *,
    names: tuple[str, ...] = (),
    compiles: bool = False,
) -> Any:
    """The result of the call, or None where it was refused as promised; raises `Broken` where neither is so.

    `names` are those of which the message has to contain one. Code that was never used before may be compiled where
    `compiles` says so.
    """
    CASES[kind] += 1
    _COMPILES.names.clear()
    refusal = None
    try:
        with (
            watched(SECONDS if not compiles else 120.0),
            warnings.catch_warnings(record=True) as caught,
        ):
            warnings.simplefilter("always")
            result = call()
    except FrictionError as error:
        refusal = str(error)
        result = None
    except Broken:
        raise
    except Exception as error:
        where = error.__traceback__
        while where is not None and where.tb_next is not None:
            where = where.tb_next
        place = (
            f"{where.tb_frame.f_code.co_filename.split('planarfriction/')[-1]}:{where.tb_lineno}"
            if where
            else "?"
        )
        raise Broken(
            f"foreign {type(error).__name__} from {place}: {str(error)[:200]}"
        ) from error
    if refusal is not None:
        CASES[f"{kind}, refused"] += 1
        _judge_message(refusal, names)
    if foreign := [
        each for each in caught if not issubclass(each.category, UserWarning)
    ]:
        raise Broken(
            f"warns {foreign[0].category.__name__}: {str(foreign[0].message)[:100]} ({foreign[0].filename})"
        )
    if _COMPILES.names and not compiles:
        raise Broken(f"compiles {', '.join(_COMPILES.names)} inside the call")
    return result


def _judge_message(message: str, names: tuple[str, ...]) -> None:
    length = len(re.sub(r"(one of|valid:|has) [\w., -]+", "", message))
    if not message.strip() or length > LONGEST or not message.isprintable():
        raise Broken(
            f"the message is no line of at most {LONGEST} characters: {message[:200]!r} ({len(message)})"
        )
    if message.startswith("at t = "):  # of a run that ended there
        return
    plain = message.replace("-", "_").replace(" ", "_").lower()
    if names and not any(
        re.search(rf"(?<![a-z]){name.strip('_').lower()}", plain) for name in names
    ):
        raise Broken(f"the message names none of {', '.join(names)}: {message!r}")


def finite(value: Any, where: str = "result") -> None:
    """Raise `Broken` where numbers in `value` are not finite."""
    if isinstance(value, (tuple, list)):
        for each in value:
            finite(each, where)
    elif np.asarray(value).dtype.kind in "fc" and not np.isfinite(value).all():
        raise Broken(f"{where} is not finite: {str(value)[:80]!r}")
