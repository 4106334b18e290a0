"""Keys of runs: digests of the plain form of a scene, the version of the library, and the name of the measurement."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import inspect
import json
import operator
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

from planarfriction import __version__
from planarfriction.errors import InvalidValueError
from planarfriction.scenes import Scene, Signal
from planarfriction.scenes.files import scene_to_dict
from planarfriction.scenes.model_files import model_to_dict

LAYOUT = 3
"""Number of the layout of stored runs: files of another layout do not count."""

KEPT = 32
"""Number of models, with the maps they have built, and of plain forms that are kept for later scenes."""


@functools.cache
def library_version() -> str:
    """Return the version of the library with a digest of its sources: other equations make other runs."""
    root = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for file in sorted(root.rglob("*.py")):
        digest.update(
            file.relative_to(root).as_posix().encode()
            + hashlib.sha256(file.read_bytes()).digest()
        )
    return f"{__version__} {digest.hexdigest()}"


def name_of(measure: Any, kept: bool) -> str:
    """Return module, name and source of a measurement, by which its runs are found again if they are `kept`.

    Raises InvalidValueError for a measurement of kept runs without a name: a lambda, or a function that
    depends on values from around it.
    """
    named = (
        isinstance(measure, types.FunctionType)
        and measure.__name__.isidentifier()
        and not measure.__closure__
    )
    if kept and measure is not None and not named:
        raise InvalidValueError(
            "measure",
            "be a function with a name, and without values from around it, if out is given: runs are found by it",
            measure,
        )
    try:
        source = inspect.getsource(measure)  # pyright: ignore[reportArgumentType]
    except (OSError, TypeError):  # typed into a prompt, or no function
        source = ""
    name = getattr(measure, "__qualname__", type(measure).__name__)
    return f"{getattr(measure, '__module__', '')}.{name}\n{source}"


class Keys:
    """Keys of runs, whose models are shared: of equal ones every scene gets the first, with all that it has built."""

    def __init__(self, measure: Any, kept: bool, bristles: str = "none") -> None:
        self._common = [LAYOUT, library_version(), name_of(measure, kept), bristles]
        self._kept = kept
        self._models: dict[str, Any] = {}
        """First models by their digests."""
        self._digests: dict[int, tuple[Any, str]] = {}
        """Digests of models and signals by their identity; the parts are held so that no other gets it."""

    def shared(self, scene: Scene) -> Scene:
        """Return the scene with the models of earlier scenes where they are equal."""
        contacts = []
        for contact in scene.contacts:
            digest = self._of_part(contact.model)
            model = _kept(self._models, digest, lambda first=contact.model: first)
            if model is not contact.model:
                contact = dataclasses.replace(contact, model=model)
            contacts.append(contact)
        same = all(map(operator.is_, contacts, scene.contacts))
        return scene if same else dataclasses.replace(scene, contacts=contacts)

    def key(self, scene: Scene) -> str:
        """Return the key of the run of a scene, the same in every process."""
        return _digest([*self._common, scene_to_dict(scene, self._table)])

    def _table(self, part: Any) -> dict[str, Any]:
        """Return the digest of a part as the table that stands for it in the plain form of a scene."""
        # It is shorter than its digest.
        if isinstance(part, Signal) and len(part.times) == 1:
            return part.to_dict()
        return {"digest": self._of_part(part)}

    def _of_part(self, part: Any) -> str:
        """Return the digest of the plain form of a model, a patch or a signal, which is made once."""
        return _kept(
            self._digests, id(part), lambda: (part, self._digest_of_part(part))
        )[1]

    def _digest_of_part(self, part: Any) -> str:
        """Digest a model, patch or signal; what has no plain form counts as itself, unless its runs are to be kept."""
        try:
            if hasattr(part, "patch"):
                return _digest(model_to_dict(part, self._table))
            return _digest(part.to_dict())
        except InvalidValueError:
            if self._kept:
                raise
            return f"{type(part).__qualname__} {id(part)}"


def _digest(value: Any) -> str:
    return hashlib.sha256(
        json.dumps(value, sort_keys=True).encode(errors="surrogatepass")
    ).hexdigest()[:32]


def _kept(held: dict[Any, Any], key: Any, make: Callable[[], Any]) -> Any:
    """Return the value of a key among the `KEPT` that were used last, made if it is not there."""
    value = held.pop(key) if key in held else make()
    held[key] = value
    if len(held) > KEPT:
        del held[next(iter(held))]
    return value
