"""Changes of straight-line functions along a direction, forward mode from source to source (see `derive`).

`forward` writes a straight-line function again, so that `derive` can differentiate what calls it.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

from planarfriction.compiler import kernel
from planarfriction.kernels.derive import Derivative, Step, Walk, run_source, text_of
from planarfriction.kernels.rules import Rule


@functools.cache
def forward(function: Callable, by: tuple[str, ...], vectors: tuple[str, ...] = ()) -> Any:
    """Write a compiled function of `(arguments..., changes...)` that returns `results..., changes of the results...`.

    `by` are the arguments that change, `vectors` the arguments that are vectors (fields of records: `law.mu`).
    Raises `NotStraightError` as `derive` does.
    """
    walk = Walk(function, by, vectors)
    changes = _Changes(walk, by)
    heads = [*(walk.first[name] for name in walk.arguments), *(changes.of[walk.outer(name)] for name in by)]
    lines = [*changes.lines, f"return ({''.join(f'{name}, ' for name in [*walk.results, *changes.results()])})"]
    source = text_of(f"pushed({', '.join(heads)})", lines)
    return kernel(run_source(walk.where, source, walk.names)["pushed"])


class _Changes:
    """Lines of a function, each followed by the change of what it finds."""

    def __init__(self, walk: Walk, by: tuple[str, ...]):
        self.walk, self.lines, self.count = walk, [], 0
        self.of = {walk.outer(name): f"change_{name.replace('.', '_')}" for name in by}
        at = {step.line: step for step in walk.steps}
        for i, line in enumerate(walk.lines):
            step = at.get(i)
            if step is not None and isinstance(step.rule, Derivative):
                self._by_function(step, step.rule)
            else:
                self.lines.append(line)
                if step is not None:
                    self._by_rule(step, step.rule)

    def results(self) -> list[str]:
        """Return the names of the changes of the results."""
        return [self._change(name) for name in self.walk.results]

    def _change(self, name: str) -> str:
        return self.of.get(name) or (f"times(0.0, {name})" if name in self.walk.vectors else "0.0")

    def _emit(self, text: str) -> str:
        self.count += 1
        name = f"change_{self.count}"
        self.lines.append(f"{name} = {text}")
        return name

    def _by_rule(self, step: Step, rule: Rule) -> None:
        results = {"t": step.targets[0], **{f"t{r}": target for r, target in enumerate(step.targets)}}
        terms: dict[str, list[str]] = {target: [] for target in step.targets}
        for i, atom in enumerate(step.atoms):
            if (d := self.of.get(atom)) is None:
                continue
            if i in rule.pushes:
                terms[step.targets[0]].append(rule.pushes[i].format(*step.atoms, **results, d=d))
            for r, target in enumerate(step.targets):
                slope = rule.slopes.get((r, i), rule.slopes.get(i) if r == 0 else None)
                if slope is not None:
                    terms[target].append(f"{d} * ({slope.format(*step.atoms, **results)})")
        for target, texts in terms.items():
            if texts:
                vector = target in self.walk.vectors
                added = functools.reduce(lambda a, b: f"plus({a}, 1.0, {b})", texts) if vector else " + ".join(texts)
                self.of[target] = self._emit(added)

    def _by_function(self, step: Step, inner: Derivative) -> None:
        name = f"pushed_{inner.function.__name__.strip('_')}_{step.line}"
        self.walk.names[name] = forward(inner.function, inner.by, inner.vectors)
        for target in step.targets:
            self.count += 1
            self.of[target] = f"change_{self.count}"
        changes = [self._change_of(step, inner, path) for path in inner.by]
        targets = [*step.targets, *(self.of[target] for target in step.targets)]
        self.lines.append(f"{', '.join(targets)} = {name}({', '.join([*step.atoms, *changes])})")

    def _change_of(self, step: Step, inner: Derivative, path: str) -> str:
        head, dot, rest = path.partition(".")
        return self._change(step.atoms[inner.arguments.index(head)] + dot + rest)
