"""Cache of machine code on disk, under a digest of every source that it may be made from.

Numba's own cache looks at the file of the cached function alone, so it is stale after a change of a formula that the
function calls; two writers, or one that is killed, can damage it; and it fails where no folder can be written. Here a
function has one file for each signature and processor, written whole and sealed with its origin and a checksum. A file
that does not fit is compiled anew.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import shutil
import warnings
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numba.core import config
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.registry import cpu_target
from numba.core.runtime import rtsys
from numba.core.serialize import dumps
from numba.core.sigutils import normalize_signature
from numba.misc.appdirs import AppDirs

from planarfriction._engine.compiler.numba_compat import need, part
from planarfriction._engine.compiler.parallel import wait_for
from planarfriction._engine.compiler.sources import Sources, digest_of
from planarfriction._support.writing import replacing

need(CompileResult, "_reduce", "_rebuild")
_PASSES = "planarfriction._engine.compiler.interrupts", "heard_between_passes"
heard_between_passes = part(*_PASSES, contextlib.nullcontext)
shortcuts = part(
    "planarfriction._engine.compiler.shortcuts", "shortcuts", contextlib.nullcontext
)

_SETTINGS = (
    "OPT",
    "BOUNDSCHECK",
    "DEBUGINFO_DEFAULT",
    "LOOP_VECTORIZE",
    "SLP_VECTORIZE",
    "USING_SVML",
)
"""Settings of Numba that change machine code; the processor and its features are in the key of the target."""

_VERSIONS_KEPT = 8
"""Number of folders of machine code that stay in one place (10 MB each after `warm`), for versions and for changes."""

_SEAL = 36
"""Length [bytes] of the beginning of a file that certifies its origin and its content."""


def kept(dispatcher: Any, sources: Sources) -> Any:
    """Let a function that Numba compiles keep its machine code on disk and hear Ctrl-C while it compiles."""
    if config.DISABLE_JIT:
        return dispatcher
    function = dispatcher.py_func
    digest = digest_of(Path(function.__code__.co_filename))
    if (
        digest is not None
        and sources.digest is not None
        and function.__closure__ is None
    ):
        dispatcher._cache = MachineCode(function, digest, sources)
    compile_deaf = dispatcher.compile

    def compile_hearing(signature: Any) -> Any:
        wait_for(dispatcher)
        with heard_between_passes(), shortcuts():
            return compile_deaf(signature)

    dispatcher.compile = compile_hearing
    return dispatcher


def missing(dispatcher: Any, signature: tuple) -> bool:
    """Return True if a function has yet to be compiled, and its machine code can be kept on disk."""
    cache = getattr(dispatcher, "_cache", None)
    if not isinstance(cache, MachineCode) or signature in dispatcher.overloads:
        return False
    return not cache.holds(signature, dispatcher.targetctx) and cache.writable()


def folders(sources: Sources) -> Iterator[Path]:
    """Yield the folders for machine code of these sources in the order in which they are read and written."""
    if config.CACHE_DIR:
        places = [Path(config.CACHE_DIR)]
    else:
        user = Path(AppDirs("planarfriction", appauthor=False).user_cache_dir)
        places = [sources.root / "__pycache__", *([user] if user.is_absolute() else [])]
    return (place / f"planarfriction-{sources.digest}" for place in places)


class MachineCode(NullCache):
    """Machine code of one function on disk, with the interface that Numba expects of a cache."""

    warned = False
    """True once the user was warned that nothing can be kept."""

    def __init__(self, function: Any, digest: str, sources: Sources) -> None:
        path = Path(function.__code__.co_filename)
        name = function.__qualname__
        self._sources = sources
        self._name = f"{path.stem}.{name}"
        self._identity = (sources.name_of(path), name, digest)

    def writable(self) -> bool:
        """Return True if there is a folder for machine code that can be written."""
        for folder in folders(self._sources):
            with contextlib.suppress(OSError):
                _make(folder)
                if os.access(folder, os.W_OK):
                    return True
        return False

    def _file(self, arguments: tuple, codegen: Any) -> tuple[str, bytes]:
        """Return the name of the file for a signature, and the origin of its machine code."""
        settings = [str(getattr(config, name, None)) for name in _SETTINGS]
        variant = repr(
            (self._identity[0], str(arguments), codegen.magic_tuple(), settings)
        )
        name = (
            f"{self._name}-{hashlib.sha256(variant.encode()).hexdigest()[:16]}.machine"
        )
        return name.replace("<", "").replace(">", ""), repr(
            (self._sources.digest, self._identity, variant)
        ).encode()

    def holds(self, signature: tuple, target_context: Any) -> bool:
        """Return True if there is a file for a signature; whether it is sound shows when it is read."""
        name, _ = self._file(signature, target_context.codegen())
        return any((folder / name).is_file() for folder in folders(self._sources))

    def load_overload(self, sig: Any, target_context: Any) -> CompileResult | None:
        """Read the function for a signature; None if its file is missing, of another origin or damaged."""
        # All that machine code takes of Numba is the counting of references. What compilation takes is loaded with the
        # first one: half of what a process does before its first step.
        rtsys.initialize(target_context)
        arguments, _ = normalize_signature(sig)
        name, origin = self._file(arguments, target_context.codegen())
        return _read(
            self._sources,
            name,
            origin,
            lambda content: _unpacked(content, arguments, target_context),
        )

    def save_overload(self, sig: Any, data: CompileResult) -> None:
        """Write the machine code for a signature to the first folder that takes it."""
        if data.library.has_dynamic_globals or data.lifted:
            return
        name, origin = self._file(normalize_signature(sig)[0], data.codegen)
        reason = _write(self._sources, name, origin, dumps(data._reduce()))
        if reason is not None:
            self._tell(reason)

    @classmethod
    def _tell(cls, reason: str) -> None:
        """Warn the user, once in a process."""
        if not cls.warned:
            cls.warned = True
            warnings.warn(
                f"compiled code is not kept, each process compiles anew ({reason}): "
                "name a folder that can be written in NUMBA_CACHE_DIR",
                RuntimeWarning,
                stacklevel=3,
            )


def _seal(origin: bytes, content: bytes) -> bytes:
    return hashlib.sha256(origin).digest() + _checksum(content)


def _checksum(content: bytes) -> bytes:
    return zlib.crc32(content).to_bytes(4)


def target() -> tuple[str, set[str]]:
    """Return the processor that code is compiled for and its features, by LLVM's names."""
    _, name, features = cpu_target.target_context.codegen().magic_tuple()
    return name, {
        feature[1:] for feature in features.split(",") if feature.startswith("+")
    }


def whole(file: Path) -> bool:
    """Return True if the content of a file of machine code fits its checksum."""
    read = file.read_bytes()
    return read[:_SEAL].endswith(_checksum(read[_SEAL:]))


def _unpacked(content: bytes, arguments: tuple, target_context: Any) -> CompileResult:
    compiled = CompileResult._rebuild(target_context, *pickle.loads(content))
    if compiled.signature.args != arguments:
        raise ValueError("of other types that go by the same names")
    return compiled


def kept_numbers(
    name: str, origin: bytes, make: Callable[[], np.ndarray], sources: Sources
) -> np.ndarray:
    """Return numbers that are read from disk, or made and kept there beside the machine code.

    `origin` is all that they are made from; the file is called by `name`.
    """
    file = f"{name}-{hashlib.sha256(origin).hexdigest()[:16]}.numbers"
    found = _read(sources, file, origin, np.frombuffer)
    if found is None:
        found = make()
        _write(sources, file, origin, found.tobytes())
    return found


def _read(sources: Sources, name: str, origin: bytes, unpacked: Any) -> Any:
    """Return what is in a file; None if it is missing, of another origin or damaged."""
    for path in (folder / name for folder in folders(sources)):
        try:
            file = path.read_bytes()
            content = file[_SEAL:]
            if file[:_SEAL] != _seal(origin, content):
                raise ValueError("damaged, or made from other sources")
            return unpacked(content)
        except (FileNotFoundError, NotADirectoryError):
            continue
        except Exception:  # whatever a damaged file does, making it anew is the remedy
            with contextlib.suppress(OSError):
                path.unlink()
    return None


def _write(sources: Sources, name: str, origin: bytes, content: bytes) -> str | None:
    """Write a file to the first folder that takes it; return the reason if none does."""
    if not sources.unchanged():
        return None
    reason = None
    for folder in folders(sources):
        try:
            _make(folder)
            with replacing(folder / name) as file:
                file.write(_seal(origin, content) + content)
            return None
        except OSError as error:
            reason = str(error)
    return reason


def _make(folder: Path) -> None:
    """Make a folder for machine code, and delete the oldest folders beside it that hold other versions."""
    if folder.is_dir():
        return
    folder.mkdir(parents=True, exist_ok=True)
    with contextlib.suppress(OSError):  # another process may drop them too
        others = [
            one
            for one in folder.parent.glob("planarfriction-" + "[0-9a-f]" * 16)
            if one != folder
        ]
        for old in sorted(others, key=lambda one: one.stat().st_mtime)[
            : 1 - _VERSIONS_KEPT
        ]:
            shutil.rmtree(old, ignore_errors=True)
