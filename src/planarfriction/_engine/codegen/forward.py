"""Changes of straight-line functions along a direction, forward mode from source to source (see `derive`).

`forward` writes a straight-line function again, so that `derive` can differentiate its callers.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

from planarfriction._engine.codegen.derive import (
    Derivative,
    Step,
    Walk,
    run_source,
    text_of,
)
from planarfriction._engine.codegen.rules import Rule
from planarfriction._engine.compiler import kernel


class Directions(NamedTuple):
    """A function with its changes along several directions, compiled into its callers."""

    pushed: Any
    """Takes the arguments, then the changes of each direction; returns the results, then their changes likewise."""
    changing: tuple[tuple[bool, ...], ...]
    """For each direction, True for the results that change along it."""


def forward(
    function: Callable, by: tuple[str, ...], vectors: tuple[str, ...] = ()
) -> Any:
    """Write a compiled function of `(arguments..., changes...)` that returns `results..., changes of the results...`.

    `by` are the arguments that change, `vectors` the arguments that are vectors (fields of records: `law.mu`).
    Raises `NotStraightError` as `derive` does.
    """
    return forwards(function, (by,), vectors).pushed


@functools.cache
def forwards(
    function: Callable,
    directions: tuple[tuple[str, ...], ...],
    vectors: tuple[str, ...] = (),
) -> Directions:
    """Write a function with its changes along several `directions`, each the names of arguments that change.

    Common operations are computed once."""
    walk = Walk(
        function, dict.fromkeys(name for by in directions for name in by), vectors
    )
    changes = _Changes(walk, directions)
    inputs = [
        direction[walk.outer(name)]
        for direction, by in zip(changes.of, directions, strict=True)
        for name in by
    ]
    heads = [*(walk.first[name] for name in walk.arguments), *inputs]
    results = [
        changes.of_one(direction, name)
        for direction in changes.of
        for name in walk.results
    ]
    lines = [
        *changes.lines,
        f"return ({''.join(f'{name}, ' for name in [*walk.results, *results])})",
    ]
    source = text_of(f"pushed({', '.join(heads)})", lines)
    changing = tuple(
        tuple(name in direction for name in walk.results) for direction in changes.of
    )
    return Directions(
        kernel(run_source(walk.where, source, walk.names)["pushed"]), changing
    )


class _Changes:
    """Lines of a function, each followed by the changes of its results."""

    def __init__(self, walk: Walk, directions: tuple[tuple[str, ...], ...]) -> None:
        self.walk = walk
        self.lines = []
        self.count = 0
        self.of = [
            {walk.outer(name): f"change_{name.replace('.', '_')}_of_{i}" for name in by}
            for i, by in enumerate(directions)
        ]
        """Name of the change of each name, for each direction."""
        at = {step.line: step for step in walk.steps}
        for i, line in enumerate(walk.lines):
            step = at.get(i)
            if step is not None and isinstance(step.rule, Derivative):
                self._by_function(step, step.rule)
                continue
            self.lines.append(line)
            if step is not None:
                for direction in self.of:
                    self._by_rule(step, step.rule, direction)

    def of_one(self, direction: dict[str, str], name: str) -> str:
        """Return the change of a name along one direction."""
        return direction.get(name) or (
            f"times(0.0, {name})" if name in self.walk.vectors else "0.0"
        )

    def _emit(self, text: str) -> str:
        self.count += 1
        name = f"change_{self.count}"
        self.lines.append(f"{name} = {text}")
        return name

    def _by_rule(self, step: Step, rule: Rule, direction: dict[str, str]) -> None:
        results = {
            "t": step.targets[0],
            **{f"t{r}": target for r, target in enumerate(step.targets)},
        }
        terms: dict[str, list[str]] = {target: [] for target in step.targets}
        for i, atom in enumerate(step.atoms):
            if (d := direction.get(atom)) is None:
                continue
            if i in rule.pushes:
                terms[step.targets[0]].append(
                    rule.pushes[i].format(*step.atoms, **results, d=d)
                )
            for r, target in enumerate(step.targets):
                slope = rule.slopes.get((r, i), rule.slopes.get(i) if r == 0 else None)
                if slope is not None:
                    terms[target].append(
                        f"{d} * ({slope.format(*step.atoms, **results)})"
                    )
        for target, texts in terms.items():
            if texts:
                vector = target in self.walk.vectors
                added = (
                    functools.reduce(lambda a, b: f"plus({a}, 1.0, {b})", texts)
                    if vector
                    else " + ".join(texts)
                )
                direction[target] = self._emit(added)

    def _by_function(self, step: Step, inner: Derivative) -> None:
        places = {path: inner.place(step, path) for path in inner.by}
        inputs = [
            {
                path: direction[place]
                for path, place in places.items()
                if place in direction
            }
            for direction in self.of
        ]
        written = forwards(
            inner.function, tuple(tuple(each) for each in inputs), inner.vectors
        )
        name = f"pushed_{inner.function.__name__.strip('_')}_{step.line}"
        self.walk.names[name] = written.pushed
        targets = list(step.targets)
        for direction, changing in zip(self.of, written.changing, strict=True):
            for target, moves in zip(step.targets, changing, strict=True):
                self.count += 1
                targets.append(f"change_{self.count}")
                if moves:
                    direction[target] = targets[-1]
        changes = [change for each in inputs for change in each.values()]
        self.lines.append(
            f"{', '.join(targets)} = {name}({', '.join([*step.atoms, *changes])})"
        )
