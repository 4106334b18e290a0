"""Functions with the code of others that see other globals: compiled functions over symbols, or over arrays."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping
from types import CellType, CodeType, FunctionType, ModuleType
from typing import Any


def like(a: Any, numbers: Iterable[Any]) -> Any:
    """Return a tuple of numbers of the kind of `a`, a record if that is one."""
    if hasattr(a, "_fields"):
        return type(a)(*numbers)
    return type(a)(numbers) if isinstance(a, tuple) else tuple(numbers)


def _plain(original: Any) -> Any:
    """Return the Python function of a compiled one, anything else as it is."""
    return getattr(original, "py_func", original)


class Rewriting:
    """Map from functions, modules and records of functions to their twins; anything else is its own twin.

    A twin has the code of its function and sees twins in place of globals, the given ones of `known` among them.
    """

    def __init__(
        self, known: Iterable[tuple[Any, Any]], names: Mapping[str, Any] | None = None,
        finished: Callable[[FunctionType], Any] = lambda twin: twin,
    ) -> None:  # fmt: skip
        # an `id` is that of an object that is kept
        self._twins = {
            id(_plain(original)): (twin, original) for original, twin in known
        }
        self._names = names or {}
        self._finished = finished
        self._begun: dict[int, tuple[Any, Any]] = {}
        self._lock = threading.RLock()

    def __call__(self, original: Any) -> Any:
        """Return the twin; other threads see it once the globals of all that it calls are there."""
        original = _plain(original)
        if id(original) in self._twins:
            return self._twins[id(original)][0]
        with self._lock:
            outermost = not self._begun
            twin = self._twin(original)
            if outermost:
                self._twins.update(self._begun)
                self._begun.clear()
        return twin

    def _twin(self, original: Any) -> Any:
        if id(original) in self._begun:
            return self._begun[id(original)][0]
        if isinstance(original, ModuleType):
            return _Module(original, self)
        if isinstance(original, tuple):
            return like(original, [self(each) for each in original])
        if not isinstance(original, FunctionType):
            return original
        space: dict[str, Any] = {
            "__builtins__": original.__globals__.get("__builtins__"),
            **self._names,
        }
        cells = [CellType() for _ in original.__closure__ or ()]
        made = FunctionType(
            original.__code__,
            space,
            original.__name__,
            original.__defaults__,
            tuple(cells),
        )
        twin = self._finished(made)
        self._begun[id(original)] = twin, original
        names = _global_names(original.__code__)
        for name in names & original.__globals__.keys():
            space[name] = self(original.__globals__[name])
            if isinstance(space[name], _Module):
                space[name].look_up(names)
        for cell, outer in zip(cells, original.__closure__ or (), strict=True):
            cell.cell_contents = self(outer.cell_contents)
        return twin


class _Module:
    """A module whose functions are twins."""

    def __init__(self, original: ModuleType, rewriting: Rewriting) -> None:
        self._module = original
        self._rewriting = rewriting

    def look_up(self, names: Iterable[str]) -> None:
        """Hold what the module has under these names: `torch.compile` reads attributes, but makes no twins."""
        for name in names:
            if hasattr(self._module, name):
                setattr(self, name, self._rewriting(getattr(self._module, name)))

    def __getattr__(self, name: str) -> Any:
        return self._rewriting(getattr(self._module, name))


def _global_names(code: CodeType) -> set[str]:
    """Return the names that code and the code inside it may look up."""
    inner = [each for each in code.co_consts if isinstance(each, CodeType)]
    return set(code.co_names).union(*map(_global_names, inner))
