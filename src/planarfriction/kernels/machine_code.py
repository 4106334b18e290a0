"""Machine code on disk, under the digest of everything that it was made from.

Numba's own cache looks at the file of the cached function alone: after a change of a formula that the function calls it
gives old results. It also takes a file for what its index says, which two processes that write at once, or one that is
killed, can make wrong; and it fails where no folder can be written. Here a function has one file for each signature and
processor, written whole, with a checksum over its content and what that was made from. What fits in any way but this is
compiled anew.
"""

from __future__ import annotations

import contextlib
import hashlib
import pickle
import shutil
import sys
import warnings
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core import config
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps
from numba.core.sigutils import normalize_signature
from numba.misc.appdirs import AppDirs

from planarfriction.kernels.interrupts import heard_between_passes
from planarfriction.writing import replacing

_SETTINGS = ("OPT", "BOUNDSCHECK", "DEBUGINFO_DEFAULT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "USING_SVML")
"""Numba's settings that change machine code; the processor and its features are in the key of the target."""

_VERSIONS_KEPT = 8
"""Folders of machine code that stay in one place, 4 MB each: other versions, or other sources of a developer."""


_SEAL = 36
"""Bytes at the beginning of a file that say what it is made from, and whether it is whole."""


class Sources:
    """Files whose functions any kept function may call, as they were when they were imported."""

    def __init__(self, paths: Iterable[Path]):
        self.paths = tuple(paths)
        self.digest = self._digest_now()

    def _digest_now(self) -> str | None:
        versions = (numba.__version__, llvmlite.__version__, np.__version__, sys.implementation.cache_tag)
        digest = hashlib.sha256(repr(versions).encode())
        try:
            for path in self.paths:
                digest.update(hashlib.sha256(path.read_bytes()).digest())
        except OSError:  # inside an archive, or installed without its sources
            return None
        return digest.hexdigest()[:16]

    def unchanged(self) -> bool:
        """Whether the files are still those that were imported."""
        return self.digest is not None and self.digest == self._digest_now()


def kept(dispatcher: Any, sources: Sources) -> Any:
    """Let a function that Numba compiles keep its machine code on disk and hear Ctrl-C while it compiles."""
    if config.DISABLE_JIT:
        return dispatcher
    function = dispatcher.py_func
    own = _digest_of(function.__code__.co_filename)
    if own is not None and sources.digest is not None and function.__closure__ is None:
        dispatcher._cache = MachineCode(function, own, sources)
    compile_deaf = dispatcher.compile

    def compile_hearing(signature):
        with heard_between_passes():
            return compile_deaf(signature)

    dispatcher.compile = compile_hearing
    return dispatcher


def _digest_of(path: str) -> str | None:
    try:
        return hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except OSError:  # typed into a prompt
        return None


class MachineCode(NullCache):
    """The machine code of one function on disk, in the interface that Numba asks."""

    told = False
    """Whether the user knows that nothing can be kept."""

    def __init__(self, function: Any, own: str, sources: Sources):
        self._path, self._sources = Path(function.__code__.co_filename), sources
        place = self._path.name if self._path in sources.paths else str(self._path)
        self._name, self._identity = f"{self._path.stem}.{function.__qualname__}", (place, function.__qualname__, own)

    @property
    def cache_path(self) -> str:
        """The first folder that is tried."""
        return str(next(self._folders()))

    def _folders(self) -> Iterator[Path]:
        """Where machine code may be, in the order in which it is looked for and written."""
        if config.CACHE_DIR:
            places = [Path(config.CACHE_DIR)]
        else:
            user = Path(AppDirs("planarfriction", appauthor=False).user_cache_dir)
            places = [self._path.parent / "__pycache__", *([user] if user.is_absolute() else [])]
        return (place / f"planarfriction-{self._sources.digest}" for place in places)

    def _file(self, arguments: tuple, codegen: Any) -> tuple[str, bytes]:
        """Name of the file for a signature, and what its machine code is made from."""
        settings = [str(getattr(config, name, None)) for name in _SETTINGS]
        variant = repr((self._identity[0], str(arguments), codegen.magic_tuple(), settings))
        name = f"{self._name}-{hashlib.sha256(variant.encode()).hexdigest()[:16]}.machine"
        return name.replace("<", "").replace(">", ""), repr((self._sources.digest, self._identity, variant)).encode()

    def load_overload(self, sig: Any, target_context: Any) -> CompileResult | None:
        """The function for a signature, or None where its machine code is missing, of another origin, or damaged."""
        target_context.refresh()
        arguments, _ = normalize_signature(sig)
        name, origin = self._file(arguments, target_context.codegen())
        for folder in self._folders():
            path = folder / name
            try:
                content = path.read_bytes()
                return _unpacked(content, origin, arguments, target_context)
            except (FileNotFoundError, NotADirectoryError):
                continue
            except Exception:  # whatever a damaged file does, compiling is the remedy
                with contextlib.suppress(OSError):
                    path.unlink()
        return None

    def save_overload(self, sig: Any, data: CompileResult) -> None:
        """Write the machine code for a signature to the first folder that takes it."""
        if data.library.has_dynamic_globals or data.lifted or not self._sources.unchanged():
            return
        name, origin = self._file(normalize_signature(sig)[0], data.codegen)
        content = _packed(data, origin)
        for folder in self._folders():
            try:
                _make(folder)
                with replacing(folder / name) as file:
                    file.write(content)
            except OSError as error:
                reason = str(error)
            else:
                return
        _tell(reason)


def _packed(compiled: CompileResult, origin: bytes) -> bytes:
    content = dumps(compiled._reduce())
    return _seal(origin, content) + content


def _seal(origin: bytes, content: bytes) -> bytes:
    return hashlib.sha256(origin).digest() + zlib.crc32(content).to_bytes(4)


def _unpacked(content: bytes, origin: bytes, arguments: tuple, target_context: Any) -> CompileResult:
    seal, content = content[:_SEAL], content[_SEAL:]
    if seal != _seal(origin, content):
        raise ValueError("damaged, or made from other sources")
    compiled = CompileResult._rebuild(target_context, *pickle.loads(content))
    if compiled.signature.args != arguments:
        raise ValueError("of other types that go by the same names")
    return compiled


def _make(folder: Path) -> None:
    """Make a folder, and drop the oldest of those beside it that hold other versions."""
    if folder.is_dir():
        return
    folder.mkdir(parents=True, exist_ok=True)
    with contextlib.suppress(OSError):  # another process may drop them too
        others = [one for one in folder.parent.glob("planarfriction-" + "[0-9a-f]" * 16) if one != folder]
        for old in sorted(others, key=lambda one: one.stat().st_mtime)[: 1 - _VERSIONS_KEPT]:
            shutil.rmtree(old, ignore_errors=True)


def _tell(reason: str) -> None:
    """Warn the user, once in a process."""
    if not MachineCode.told:
        MachineCode.told = True
        warnings.warn(
            f"compiled code is not kept, each process compiles anew ({reason}): "
            "name a folder that can be written in NUMBA_CACHE_DIR",
            RuntimeWarning,
            stacklevel=2,
        )
