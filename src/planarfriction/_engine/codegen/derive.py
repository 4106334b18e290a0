"""Derivatives of straight-line functions, reverse mode from source to source.

A straight-line function is assignments and one return, of numbers (`+ - * /`), of vectors (`plus`, `times`, `dot`,
`norm`, `v[i]`, `(x, y)`), of records that are read by name, and of calls of other such functions. `derive` writes two
functions for it: `forth(...)` returns `(results, tape)`, and `back(tape, bars)` the cotangents of chosen arguments
from the cotangents of the results. Both are written as text and compiled like any other kernel.

A function that is no straight line, one with a kink, or one whose derivative loses digits if it is written term by
term, has a rule of its own: see `rules`.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import inspect
import linecache
import re
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from planarfriction._engine.codegen.definitions import definition_of
from planarfriction._engine.codegen.rules import NAMES, QUOTIENT, RULES, Rule
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel


class NotStraightError(TypeError):
    """A function for which `derive` cannot write a derivative."""


class Step(NamedTuple):
    """One step of a function, taken apart."""

    targets: list[str]
    atoms: list[str]
    """Names or constants that the step reads."""
    rule: Rule | Derivative
    line: int
    """Line of the step, written anew where it has to keep a tape."""


class Walk:
    """A function taken apart into steps that do one thing each, every variable assigned once."""

    def __init__(
        self, function: Callable, by: Iterable[str], vectors: Iterable[str]
    ) -> None:
        self.function = getattr(function, "py_func", function)
        if not inspect.isfunction(self.function):
            raise NotStraightError(
                f"{self.function!r} has no source to write derivatives from: give it a `rule`"
            )
        self.where = f"{self.function.__module__}.{self.function.__qualname__}"
        self.globals = {
            **self.function.__globals__,
            **inspect.getclosurevars(self.function).nonlocals,
            "xp": xp,
        }
        self.names: dict[str, Any] = dict(NAMES)
        self.lines: list[str] = []
        self.steps: list[Step] = []
        self.results: list[str] = []
        self.count = 0
        try:
            definition = definition_of(self.function)
        except OSError as error:
            raise NotStraightError(
                f"{self.where}: there is no source to write derivatives from"
            ) from error
        self.arguments = [each.arg for each in definition.args.args]
        self.first = {name: self._new(name) for name in self.arguments}
        self.known = dict(self.first)
        self.active = {self.outer(name) for name in by}
        self.vectors = {self.outer(name) for name in vectors}
        for statement in definition.body:
            self._statement(statement)
        if not self.results:
            raise self._refusal(definition, "has no return")

    def _refusal(self, node: ast.AST, why: str) -> NotStraightError:
        text = ast.unparse(node).splitlines()[0]
        return NotStraightError(
            f"{self.where}, line {getattr(node, 'lineno', 1)}: `{text}` {why}"
        )

    def outer(self, path: str) -> str:
        """Return the generated name of an argument or of a field of one, `law.mu_c`."""
        head, dot, rest = path.partition(".")
        if head not in self.arguments:
            raise NotStraightError(
                f"{self.where} has no argument {head}, only {', '.join(self.arguments)}"
            )
        return self.first[head] + dot + rest

    def _new(self, name: str = "t") -> str:
        self.count += 1
        return f"{name}_{self.count}"

    # ------------------------------------------------------------------ statements

    def _statement(self, node: ast.stmt) -> None:
        # A docstring.
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            return
        if isinstance(node, ast.Return) and node.value is not None and not self.results:
            if isinstance(node.value, ast.Call):
                self.results = self._call(node.value)
            else:
                several = (
                    node.value.elts
                    if isinstance(node.value, ast.Tuple)
                    else [node.value]
                )
                self.results = [self._atom(each) for each in several]
        elif isinstance(node, ast.Assign):
            for target in node.targets:
                self._assign(target, node.value)
        else:
            raise self._refusal(
                node,
                "is no assignment and no return at the end: write it as one, or give it a `rule`",
            )

    def _assign(self, target: ast.expr, value: ast.expr) -> None:
        if isinstance(target, ast.Name):
            self.known[target.id] = self._atom(value)
            return
        names = target.elts if isinstance(target, ast.Tuple) else []
        if isinstance(value, ast.Tuple) and len(value.elts) == len(names):
            atoms = [self._atom(each) for each in value.elts]
        else:
            atoms = self._several(value, len(names))
        for name, each in zip(names, atoms, strict=True):
            if not isinstance(name, ast.Name):
                raise self._refusal(target, "is no name to assign to")
            self.known[name.id] = each

    # ------------------------------------------------------------------ expressions

    def _several(self, node: ast.expr, count: int) -> list[str]:
        """Return the names of `count` values: results of a call, or components of a vector."""
        atoms = self._call(node) if isinstance(node, ast.Call) else [self._atom(node)]
        if len(atoms) == 1 and count > 1:
            return [self._item(atoms[0], i) for i in range(count)]
        if len(atoms) != count:
            raise self._refusal(node, f"has {len(atoms)} results, not {count}")
        return atoms

    def _atom(self, node: ast.expr) -> str:
        """Return the name, or the constant, that holds an expression, after the steps that find it."""
        if isinstance(node, ast.Constant):
            return repr(node.value)
        if isinstance(node, ast.Name):
            return self._name(node)
        if isinstance(node, ast.Attribute):
            return f"{self._atom(node.value)}.{node.attr}"
        if isinstance(node, ast.Call):
            results = self._call(node)
            return results[0] if len(results) == 1 else self._vector(results)
        if isinstance(node, ast.Tuple):
            return self._vector([self._atom(each) for each in node.elts])
        if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant):
            return self._item(self._atom(node.value), node.slice.value)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            return self._number(node, "-{0}", [node.operand])
        if isinstance(node, ast.BinOp) and type(node.op) in _SIGNS:
            return self._number(
                node, f"{{0}} {_SIGNS[type(node.op)]} {{1}}", [node.left, node.right]
            )
        return self._condition(node)

    def _name(self, node: ast.Name) -> str:
        if node.id in self.known:
            return self.known[node.id]
        if node.id not in self.globals:
            raise self._refusal(node, "is not known")
        self._use(node.id, self.globals[node.id])
        return node.id

    def _use(self, name: str, value: Any) -> None:
        if self.names.setdefault(name, value) is not value:
            raise NotStraightError(
                f"{self.where} and a rule mean different things by {name}"
            )

    def _condition(self, node: ast.expr) -> str:
        """Return a comparison, or several joined: choices have no derivative."""
        if isinstance(node, ast.Compare):
            text = self._atom(node.left)
            for operator, right in zip(node.ops, node.comparators, strict=True):
                text += f" {_COMPARISONS[type(operator)]} {self._atom(right)}"
        elif isinstance(node, ast.BoolOp):
            joined = " and " if isinstance(node.op, ast.And) else " or "
            text = joined.join(self._atom(each) for each in node.values)
        elif isinstance(node, ast.BinOp) and isinstance(
            node.op, (ast.BitAnd, ast.BitOr)
        ):
            text = f"{self._atom(node.left)} {'&' if isinstance(node.op, ast.BitAnd) else '|'} {self._atom(node.right)}"
        else:
            raise self._refusal(
                node, "is no straight line: use `xp.where`, or a function with a `rule`"
            )
        return self.emit(text)

    def emit(self, text: str, name: str = "t") -> str:
        target = self._new(name)
        self.lines.append(f"{target} = {text}")
        return target

    def _number(
        self, node: ast.BinOp | ast.UnaryOp, text: str, operands: list[ast.expr]
    ) -> str:
        atoms = [self._atom(each) for each in operands]
        if self.vectors.intersection(atoms):
            raise self._refusal(node, "is of vectors: use `plus`, `times`, `dot`")
        if isinstance(node.op, ast.Div) and atoms[1] in self.active:
            atoms.append(self.emit(f"1.0 / {atoms[1]}"))
            return self._taken(
                [self.emit(f"{atoms[0]} * {atoms[2]}")], atoms, QUOTIENT
            )[0]
        target = self.emit(text.format(*atoms))
        return self._taken([target], atoms, RULES[type(node.op)])[0]

    def _vector(self, items: list[str]) -> str:
        target = self.emit(f"({', '.join(items)},)")
        pulls = {i: f"{{b}}[{i}]" for i in range(len(items))}
        pushes = {
            i: "("
            + ", ".join("{d}" if i == j else "0.0" for j in range(len(items)))
            + ",)"
            for i in pulls
        }
        return self._taken([target], items, Rule("v", {}, pulls, pushes))[0]

    def _item(self, vector: str, i: int) -> str:
        target = self.emit(f"{vector}[{i}]")
        how = Rule("s", {}, {0: f"placed({{0}}, {i}, {{b}})"}, {0: f"{{d}}[{i}]"})
        return self._taken([target], [vector], how)[0]

    def _taken(
        self, targets: list[str], atoms: list[str], how: Rule | Derivative
    ) -> list[str]:
        """Note a step and the kinds of its results."""
        self.vectors.update(
            name for name, kind in zip(targets, how.results, strict=True) if kind == "v"
        )
        if any(self._inside(atom) for atom in atoms):
            self.active.update(targets)
            self.steps.append(Step(targets, atoms, how, len(self.lines) - 1))
        return targets

    def _inside(self, atom: str) -> list[str]:
        """Return the active names of an atom: itself, or its fields."""
        return [
            name for name in self.active if name == atom or name.startswith(atom + ".")
        ]

    # ------------------------------------------------------------------ calls

    def _call(self, node: ast.Call) -> list[str]:
        function = self._resolve(node.func)
        path = ast.unparse(node.func)
        if node.keywords or any(isinstance(each, ast.Starred) for each in node.args):
            raise self._refusal(
                node, "has arguments by name or by star: write them one by one"
            )
        atoms = [self._atom(each) for each in node.args]
        if function in RULES:
            how: Rule | Derivative = RULES[function]
            for name, value in how.names.items():
                self._use(name, value)
        else:
            how = self._derived(function, atoms)
        targets = [self._new() for _ in how.results]
        self.lines.append(f"{', '.join(targets)} = {path}({', '.join(atoms)})")
        return self._taken(targets, atoms, how)

    def keep_tape(self, step: Step, inner: Derivative) -> tuple[str, str]:
        """Let the step of a derived function keep its tape; return the names of the tape and of the way back."""
        tape = self._new("tape")
        name = f"{inner.function.__name__.strip('_')}_{self.count}"
        self.names[f"forth_{name}"] = inner.forth
        self.names[f"back_{name}"] = inner.back
        self.lines[step.line] = (
            f"({', '.join(step.targets)},), {tape} = forth_{name}({', '.join(step.atoms)})"
        )
        return tape, f"back_{name}"

    def _resolve(self, node: ast.expr) -> Any:
        """Return the function that a call names, and note it for the generated code."""
        if isinstance(node, ast.Attribute):
            return getattr(self._resolve(node.value), node.attr)
        if not isinstance(node, ast.Name) or (
            node.id in self.known and node.id != "xp"
        ):
            raise self._refusal(node, "is no function of its module")
        self._name(node)
        return self.globals[node.id]

    def _derived(self, function: Any, atoms: list[str]) -> Derivative:
        names = list(
            inspect.signature(getattr(function, "py_func", function)).parameters
        )
        pairs = list(zip(names, atoms, strict=True))
        by = tuple(
            name + path[len(atom) :]
            for name, atom in pairs
            for path in sorted(self._inside(atom))
        )
        vectors = tuple(
            name + path[len(atom) :]
            for name, atom in pairs
            for path in sorted(self.vectors)
            if path == atom or path.startswith(atom + ".")
        )
        return derive(function, by, vectors)


_SIGNS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
_COMPARISONS = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}


class _WayBack:
    """Cotangents through the steps of a function, last step first, which add partial derivatives to its lines."""

    def __init__(self, walk: Walk, live: tuple[int, ...]) -> None:
        self.walk = walk
        self.lines = []
        self.count = 0
        self.bars: dict[str, str] = {}
        for i, result in enumerate(live):
            self._add(walk.results[result], f"bars[{i}]")
        for step in reversed(walk.steps):
            bars = [self.bars.pop(target, "") for target in step.targets]
            if not any(bars):
                continue
            if isinstance(step.rule, Rule):
                self._by_rule(step, step.rule, bars)
            else:
                self._by_derivative(step, step.rule, bars)

    def emit(self, text: str, name: str = "bar") -> str:
        self.count += 1
        target = f"{name}_{self.count}"
        self.lines.append(f"{target} = {text}")
        return target

    def _add(self, name: str, text: str) -> None:
        """Add to the cotangent of a name."""
        before = self.bars.get(name)
        if before is None:
            self.bars[name] = text if text.isidentifier() else self.emit(text)
        else:
            vector = name in self.walk.vectors
            self.bars[name] = self.emit(
                f"plus({before}, 1.0, {text})" if vector else f"{before} + {text}"
            )

    def cotangent(self, name: str) -> str:
        """Return the cotangent of a name, zero where the results do not depend on it."""
        return self.bars.get(name) or (
            f"zeros({name})" if name in self.walk.vectors else "0.0"
        )

    def _by_rule(self, step: Step, rule: Rule, bars: list[str]) -> None:
        results = {
            "t": step.targets[0],
            **{f"t{r}": target for r, target in enumerate(step.targets)},
        }
        kept = {}
        for key, text in rule.slopes.items():
            r, i = key if isinstance(key, tuple) else (0, key)
            if isinstance(i, str):
                kept[i] = self._kept(text.format(*step.atoms, **results))
            elif step.atoms[i] in self.walk.active and bars[r]:
                self._add(
                    step.atoms[i],
                    self._product(
                        bars[r], text.format(*step.atoms, **results), step.atoms[i]
                    ),
                )
        for i, text in rule.pulls.items():
            if step.atoms[i] in self.walk.active:
                self._add(
                    step.atoms[i],
                    text.format(*step.atoms, **results, **kept, b=bars[0]),
                )

    def _product(self, bar: str, slope: str, atom: str) -> str:
        if slope in ("1.0", "-1.0"):
            return bar if slope == "1.0" else f"-{bar}"
        slope = self._kept(slope)
        return (
            f"times({bar}, {slope})"
            if atom in self.walk.vectors
            else f"{bar} * {slope}"
        )

    def _kept(self, text: str) -> str:
        """Return the name that holds a partial derivative, found on the way forth."""
        return (
            text
            if text.replace(".", "_").isidentifier()
            else self.walk.emit(text, "slope")
        )

    def _by_derivative(self, step: Step, inner: Derivative, bars: list[str]) -> None:
        inner = derive(
            inner.function,
            inner.by,
            inner.vectors,
            tuple(i for i, bar in enumerate(bars) if bar),
        )
        tape, name = self.walk.keep_tape(step, inner)
        pulled = self.emit(
            f"{name}({tape}, ({''.join(bar + ', ' for bar in bars if bar)}))", "bars"
        )
        for i, path in enumerate(inner.by):
            self._add(inner.place(step, path), f"{pulled}[{i}]")


class Derivative(NamedTuple):
    """A function with its derivative, both compiled into their callers."""

    function: Callable
    arguments: tuple[str, ...]
    by: tuple[str, ...]
    """Arguments, or fields of arguments, whose cotangents `back` returns, in this order."""
    vectors: tuple[str, ...]
    results: str
    """Kind of each result."""
    source: str
    """Text of `forth` and `back`."""
    forth: Any
    """Return the results and a tape, from the arguments of the function."""
    back: Any
    """Return the cotangents of `by`, from the tape and a tuple of the cotangents of the `live` results."""

    def place(self, step: Step, path: str) -> str:
        """Return the name of an argument, or of a field of one, that a step gives to this function."""
        head, dot, rest = path.partition(".")
        return step.atoms[self.arguments.index(head)] + dot + rest


@functools.cache
def derive(
    function: Callable,
    by: tuple[str, ...],
    vectors: tuple[str, ...] = (),
    live: tuple[int, ...] | None = None,
) -> Derivative:
    """Write the derivative of a straight-line function.

    `by` are the arguments to differentiate by, a field of a record as `law.mu_c`; `vectors` the names of vectors,
    `live` the results that have a cotangent, unless all do.
    Raises `NotStraightError` with the line that cannot be taken apart. The text depends on nothing but the sources.
    """
    walk = Walk(function, by, vectors)
    back = _WayBack(walk, tuple(range(len(walk.results))) if live is None else live)
    wanted = [back.cotangent(walk.outer(name)) for name in by]
    lines = [*back.lines, f"return ({''.join(name + ', ' for name in wanted)})"]
    made = {
        target for line in walk.lines for target in _names(line.partition(" = ")[0])
    } | set(walk.first.values())
    tape = "".join(
        f"{name}, "
        for name in sorted(made & {name for line in lines for name in _names(line)})
    )
    forth = [
        *walk.lines,
        f"return ({''.join(name + ', ' for name in walk.results)}), ({tape})",
    ]
    heads = ", ".join(walk.first[name] for name in walk.arguments)
    unpack = [f"({tape}) = tape"] if tape else []
    source = (
        text_of(f"forth({heads})", forth)
        + "\n\n"
        + text_of("back(tape, bars)", unpack + lines)
    )
    space = run_source(walk.where, source, walk.names)
    kinds = "".join("v" if result in walk.vectors else "s" for result in walk.results)
    forward = kernel(space["forth"])
    backward = kernel(space["back"])
    return Derivative(
        walk.function,
        tuple(walk.arguments),
        by,
        vectors,
        kinds,
        source,
        forward,
        backward,
    )


def _names(text: str) -> set[str]:
    return set(re.findall(r"(?<![.\w])[A-Za-z_]\w*", text))  # but not those of fields


def text_of(head: str, lines: list[str]) -> str:
    return "\n    ".join([f"def {head}:", *lines]) + "\n"


def run_source(where: str, source: str, names: dict[str, Any]) -> dict[str, Any]:
    """Run generated source, and let tracebacks show it."""
    file = f"<derivative of {where} {hashlib.sha256(source.encode()).hexdigest()[:8]}>"
    linecache.cache[file] = len(source), None, source.splitlines(True), file
    space = dict(names)
    exec(compile(source, file, "exec"), space)
    return space
