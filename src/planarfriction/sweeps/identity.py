"""What identifies a run: a digest of its scene, of what is measured, and of the equations behind both.

Python's own hashes differ from process to process, and those of a scene's JSON cost a tenth of a short run.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import operator
import pickle
import sys
import types
from collections.abc import Callable, Mapping, Set
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from planarfriction import __version__
from planarfriction.errors import InvalidValueError

if TYPE_CHECKING:
    from planarfriction.scenes import Scene

LAYOUT = 1
"""Number of the layout of what a run leaves: files of another one do not count."""

_EQUATIONS = ("formulas", "geometry", "kernels", "laws", "limit_surface", "models", "patch", "scenes", "solvers")
"""Parts of the library that decide what comes out of a run."""

MODELS_KEPT = 32
"""Models, with the maps they have built, that are kept for later scenes with equal ones."""

_PLAIN = (bool, int, float, complex, str, bytes, type(None))

_KINDS = frozenset(_PLAIN)


@functools.cache
def equations() -> str:
    """Digest of the sources that decide what comes out of a run; the version where there are none to read."""
    root = Path(__file__).parents[1]
    files = sorted(file for name in _EQUATIONS for file in (root / name).rglob("*.py"))
    files += [file for name in _EQUATIONS if (file := root / f"{name}.py").is_file()]
    digest = hashlib.sha256(__version__.encode())
    for file in files:
        digest.update(file.relative_to(root).as_posix().encode() + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()


def digest_of(*parts: Any) -> str:
    """Digest of values by their content, the same in every process: equal parts have equal digests.

    Records count by their fields, functions by what they do: code, defaults, what they close over, and the numbers,
    texts and functions of their own module that they mention. What those of other modules do is not looked into.
    """
    content = _Content()
    for part in parts:
        content.add(part)
    return content.digest.hexdigest()[:32]


class _Content:
    """Feeds values to a digest, each after its kind, so that no two different ones are the same bytes."""

    def __init__(self) -> None:
        self.digest = hashlib.sha256()
        self._inside: set[int] = set()
        """Functions that are being looked into: they may call themselves."""

    def _say(self, text: str, content: bytes = b"") -> None:
        self.digest.update(f"{text} {len(content)};".encode() + content)

    def add(self, value: Any) -> None:
        if isinstance(value, np.generic):
            value = value.item()
        if isinstance(value, _PLAIN):
            self._say(type(value).__name__, repr(value).encode(errors="surrogatepass"))
        elif isinstance(value, np.ndarray):
            self._array(value)
        elif isinstance(value, (tuple, list)):
            if all(type(each) in _KINDS for each in value):  # at once: most of a scene is such tuples
                self._say("plain list", repr(tuple(value)).encode(errors="surrogatepass"))
                return
            self._say("list", str(len(value)).encode())
            for each in value:
                self.add(each)
        elif isinstance(value, Mapping):
            self._say("table", str(len(value)).encode())
            for key in sorted(value, key=repr):
                self.add(key)
                self.add(value[key])
        elif isinstance(value, Set):
            self.add(sorted(map(repr, value)))
        elif isinstance(value, type):
            self._kind(value)
        elif isinstance(value, types.CodeType):
            self._code(value)
        elif isinstance(value, types.FunctionType):
            self._function(value)
        elif isinstance(value, types.MethodType):
            self.add((value.__func__, value.__self__))
        elif isinstance(value, functools.partial):
            self.add((value.func, value.args, value.keywords))
        elif isinstance(value, (types.BuiltinFunctionType, types.ModuleType, np.ufunc)):
            self._say("name", f"{getattr(value, '__module__', '')}.{value.__name__}".encode())
        else:
            self._record(value)

    def _array(self, value: np.ndarray) -> None:
        if value.dtype.hasobject:
            self.add([list(value.shape), value.ravel().tolist()])
            return
        self._say(f"array {value.dtype.str} {value.shape}", value.tobytes())

    def _record(self, value: Any) -> None:
        kind = type(value)
        self._kind(kind)
        if dataclasses.is_dataclass(value):
            names = [field.name for field in dataclasses.fields(value) if field.compare]
        elif hasattr(value, "__dict__"):  # but for what is calculated from the rest and remembered
            kept = {name for each in kind.__mro__ for name, of in vars(each).items() if _is_remembered(of)}
            names = [name for name in sorted(vars(value)) if name not in kept]
        else:
            self._say("pickle", pickle.dumps(value))
            return
        for name in names:
            self._say("field", name.encode())
            self.add(getattr(value, name))

    def _kind(self, kind: type) -> None:
        """A class: of the library and of others by its name, of a user's own by what its functions do too."""
        self._say("class", f"{kind.__module__}.{kind.__qualname__}".encode())
        if kind.__module__.partition(".")[0] == "planarfriction" or not _of_a_script(kind):
            return
        for name, of in sorted(vars(kind).items()):
            function = getattr(of, "__func__", getattr(of, "fget", getattr(of, "func", of)))
            if isinstance(function, types.FunctionType):
                self._say("function", name.encode())
                self.add(function)

    def _function(self, function: types.FunctionType) -> None:
        if id(function) in self._inside:
            return
        self._inside.add(id(function))
        self.add((function.__code__, function.__defaults__, function.__kwdefaults__))
        self.add([_inside(cell) for cell in function.__closure__ or ()])
        for name in sorted(_mentioned(function.__code__)):
            value = function.__globals__.get(name)
            own = isinstance(value, types.FunctionType) and value.__module__ == function.__module__
            if value is not None and (own or isinstance(value, _PLAIN)):
                self._say("global", name.encode())
                self.add(value)

    def _code(self, code: types.CodeType) -> None:
        self._say("code", code.co_code)
        self.add([code.co_names, code.co_varnames, code.co_freevars])
        self.add(list(code.co_consts))


def _is_remembered(of: Any) -> bool:
    return isinstance(of, functools.cached_property)


def _of_a_script(kind: type) -> bool:
    """Whether a class is defined in Python, in a module that is no installed package."""
    file = getattr(sys.modules.get(kind.__module__), "__file__", None)
    installed = file is not None and ("site-packages" in file or "dist-packages" in file)
    return not installed and kind.__module__ not in sys.stdlib_module_names and kind.__module__ != "builtins"


def _inside(cell: types.CellType) -> Any:
    try:
        return cell.cell_contents
    except ValueError:  # not filled yet
        return None


def _mentioned(code: types.CodeType) -> set[str]:
    """Names that a function and those inside it look up."""
    inner = (each for each in code.co_consts if isinstance(each, types.CodeType))
    return set(code.co_names).union(*map(_mentioned, inner))


class Runs:
    """Digests of runs, whose models are shared: of equal ones every scene gets the first, with what it has built."""

    def __init__(self, measure: Callable[..., Any] | None) -> None:
        try:
            self._same = digest_of(LAYOUT, equations(), measure)
        except Exception:  # of parts that cannot be pickled, or that hold themselves
            rule = "be a function that depends only on plain data and functions, not on open files or locks"
            raise InvalidValueError("measure", rule, measure) from None
        self._models: dict[str, Any] = {}
        self._digests: dict[int, tuple[Any, str]] = {}
        """By the identity of models, which are held so that no other gets it."""

    def shared(self, scene: Scene) -> Scene:
        """The scene with models that earlier scenes had, where they are equal."""
        contacts = []
        for contact in scene.contacts:
            digest = self._of_model(contact.model)
            if digest not in self._models:
                _keep(self._models, digest, contact.model)
            model = self._models[digest]
            contacts.append(contact if model is contact.model else dataclasses.replace(contact, model=model))
        same = all(map(operator.is_, contacts, scene.contacts))
        return scene if same else dataclasses.replace(scene, contacts=tuple(contacts))

    def digest(self, scene: Scene) -> str:
        """Name of the run of a scene."""
        records = [scene, scene.body, *scene.contacts]
        models = [self._of_model(contact.model) for contact in scene.contacts]
        plain: list[Any] = []
        others: list[Any] = []
        for record in records:
            for name in _names(type(record)):
                value = getattr(record, name)
                if type(value) in _KINDS:
                    plain += True, value
                else:
                    plain.append(False)
                    others.append(value)
        return digest_of([self._same, *models, *plain], others)

    def _of_model(self, model: Any) -> str:
        if id(model) not in self._digests:
            _keep(self._digests, id(model), (model, digest_of(model)))
        return self._digests[id(model)][1]


def _keep(held: dict[Any, Any], key: Any, value: Any) -> None:
    """Put a value among the last `MODELS_KEPT`."""
    if len(held) >= MODELS_KEPT:
        del held[next(iter(held))]
    held[key] = value


@functools.cache
def _names(kind: type) -> tuple[str, ...]:
    """Fields of a scene and its parts but for those that are records with fields of their own, dealt with apart."""
    return tuple(field.name for field in dataclasses.fields(kind) if field.name not in ("body", "contacts", "model"))
