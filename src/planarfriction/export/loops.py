"""C functions of compiled loops: a kernel with loops is translated statement by statement.

Straight-line functions are traced (see `trace`); loops whose ends depend on numbers cannot be. Kernels take numbers,
arrays and records of them, and return numbers or records; records become separate numbers. Each kernel becomes a
function in C. Numbers that are known before, as that of the cells, are constants of the source.
"""

from __future__ import annotations

import ast
import builtins
import inspect
import math
import operator
import re
from collections.abc import Callable
from typing import Any

import numpy as np

from planarfriction._engine.codegen.definitions import definition_of
from planarfriction._engine.codegen.symbolic_functions import twin
from planarfriction._engine.codegen.trace import Number, Table, Trace, traced
from planarfriction._engine.compiler import compiled_math
from planarfriction._engine.compiler.memory import at
from planarfriction._engine.published import surfaces
from planarfriction.export.c_source import Writer
from planarfriction.export.c_values import (
    LEAVES,
    Array,
    CStruct,
    Fixed,
    Scalar,
    kind_of,
    kinds_of,
    leaves,
    mapped,
    plain,
)

_OPERATORS: dict[type, tuple[str, Callable[..., Any]]] = {
    ast.Add: ("+", operator.add), ast.Sub: ("-", operator.sub), ast.Mult: ("*", operator.mul),
    ast.Div: ("/", operator.truediv), ast.Mod: ("%", operator.mod),
    ast.FloorDiv: ("/", operator.floordiv), ast.USub: ("-", operator.neg), ast.Not: ("!", operator.not_),
    ast.Lt: ("<", operator.lt), ast.LtE: ("<=", operator.le), ast.Gt: (">", operator.gt),
    ast.GtE: (">=", operator.ge), ast.Eq: ("==", operator.eq), ast.NotEq: ("!=", operator.ne),
}  # fmt: skip

_LARGER = {
    min: "<",
    builtins.max: ">",
    compiled_math.minimum: "<",
    compiled_math.maximum: ">",
}


class Loops:
    """Source of C functions, each in front of those that call it."""

    def __init__(
        self, writer: Writer, structs: dict[np.dtype, str] | None = None
    ) -> None:
        self.writer = writer
        self.structs = structs or {}
        self.replaced: dict[Any, Callable[[Any], str]] = {}
        """Names of C functions, from their arguments, in place of a kernel: they take records and numbers of these."""
        self.functions: list[str] = []
        self._made: dict[Any, tuple[str, list[bool], Any]] = {}

    def add(
        self, kernel: Any, arguments: tuple[Any, ...]
    ) -> tuple[str, list[bool], Any]:
        """Write a kernel for arguments like these; return its name, which of their numbers it takes, and its result."""
        if kernel in self.replaced:
            return (
                self.replaced[kernel](arguments),
                [isinstance(x, (CStruct, Scalar, int)) for x in leaves(arguments)],
                None,
            )
        straight = kernel.py_func.__module__ == surfaces.__name__
        if straight:
            arguments = tuple(
                Fixed(each) if isinstance(each, (int, float)) else each
                for each in arguments
            )
        key = kernel, kinds_of(arguments)
        if key not in self._made:
            own = (_Traced if straight else _Translated)(self, kernel, arguments)
            while any(own.name == name for name, _, _ in self._made.values()):
                own.name += "_again"
            self.functions.append(own.source())
            self._made[key] = own.name, own.taken, own.result
        return self._made[key]


class _Function:
    """One kernel as a C function."""

    def __init__(self, loops: Loops, kernel: Any, arguments: tuple[Any, ...]) -> None:
        own = kernel.py_func
        self.loops = loops
        self.kernel = kernel
        self.space = own.__globals__
        self.result = None
        self.name = f"{own.__name__.strip('_')}_of_{own.__module__.rpartition('.')[2]}"
        self.lines: list[str] = []
        self.locals: dict[str, str] = {}
        self.indent = "    "
        self._parameters = []
        given = zip(inspect.signature(own).parameters, arguments, strict=True)
        self.names: dict[str, Any] = {
            name: self._parameter(name, value, self._parameters)
            for name, value in given
        }
        self._write()
        body = "\n".join(self.lines)
        self.taken = [
            text is not None and bool(re.search(rf"\b{name}\b", body))
            for name, text in self._parameters
        ]

    def _write(self) -> None:
        raise NotImplementedError

    def source(self) -> str:
        """Return the source of the function."""
        head = [
            text
            for (_, text), taken in zip(self._parameters, self.taken, strict=True)
            if text and taken
        ]
        head += (
            ["real *result"]
            if not isinstance(self.result, (Scalar, type(None)))
            else []
        )
        declared = []
        for each in ("real", "int"):
            names = [name for name, own in self.locals.items() if own == each]
            declared += [f"    {each} {', '.join(names)};"] if names else []
        lines = self.lines[: -1 if self.lines[-1] == "    return;" else None]
        kind = self.result.kind if isinstance(self.result, Scalar) else "void"
        return "\n".join(
            [
                f"static {kind} {self.name}({', '.join(head)})",
                "{",
                *declared,
                *lines,
                "}",
            ]
        )

    def _parameter(
        self, name: str, value: Any, parameters: list[tuple[str, str | None]]
    ) -> Any:
        count = len(list(leaves(value)))

        def named(each: Any) -> Any:
            place = len(parameters) - first
            own = name if count == 1 else f"{name}_{place}"
            if isinstance(each, Fixed) or getattr(each, "fixed", False):
                parameters.append((own, None))
                return each
            kind, _ = kind_of(each)
            points = isinstance(each, (Array, CStruct))
            parameters.append(
                (
                    own,
                    f"{self.loops.structs.get(kind, kind)} {'*' if points else ''}{own}",
                )
            )
            return each._replace(text=own) if points else Scalar(own, kind)

        first = len(parameters)
        return mapped(value, named)

    def _returned(self, value: Any) -> None:
        """Write numbers to the places of the result."""
        for i, each in enumerate(leaves(value)):
            self._line(f"result[{i}] = {self._of(each)};")
        places = iter(f"result[{i}]" for i in range(len(list(leaves(value)))))
        self.result = mapped(value, lambda _: Scalar(next(places)))

    def _line(self, text: str) -> None:
        self.lines.append(self.indent + text)

    def _of(self, value: Any) -> str:
        return (
            value.text
            if isinstance(value, (Scalar, Array, CStruct))
            else self.loops.writer.constant(plain(value))
        )


class _Traced(_Function):
    """A kernel of straight lines."""

    def _write(self) -> None:
        rows: dict[str, list[Any]] = {}

        def seen(trace: Trace, value: Any) -> Any:
            if isinstance(value, Array) and not value.fixed:
                return rows.setdefault(value.text, [0.0] * math.prod(value.shape))
            if isinstance(value, Array):
                return Table(trace, value.text)
            return (
                Number(trace, value.text, value.kind)
                if isinstance(value, Scalar)
                else plain(value)
            )

        def call(trace: Trace) -> Any:
            nonlocal result
            result = twin(self.kernel)(
                *(seen(trace, each) for each in self.names.values())
            )
            return (() if result is None else result, *map(tuple, rows.values()))

        result: Any = None
        block = traced(call)
        count = (
            0 if result is None else len(block.results) - sum(map(len, rows.values()))
        )
        outputs = [f"result[{i}]" for i in range(count)]
        outputs += [
            f"{name}[{i}]" for name, row in rows.items() for i in range(len(row))
        ]
        self.lines += self.loops.writer.lines(block, outputs)
        self.result = tuple(map(Scalar, outputs[:count])) or None


class _Translated(_Function):
    """A kernel with loops."""

    def _write(self) -> None:
        for statement in definition_of(self.kernel.py_func).body:
            self._do(statement)

    # ------------------------------------------------------------------ statements

    def _block(self, statements: list[ast.stmt]) -> None:
        self.indent += "    "
        for each in statements:
            self._do(each)
        self.indent = self.indent[4:]

    def _do(self, node: Any) -> None:
        getattr(self, f"_{type(node).__name__.lower()}")(node)

    def _expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Call) and isinstance(
            value := self._value(node.value), Scalar
        ):
            self._line(f"{value.text};")

    def _break(self, node: ast.Break) -> None:
        self._line("break;")

    def _if(self, node: ast.If) -> None:
        asked = self._value(node.test)
        if not isinstance(asked, Scalar):
            for each in node.body if asked else node.orelse:
                self._do(each)
            return
        whole = asked.text.startswith("(") and asked.text.endswith(")")
        self._line(f"if {asked.text if whole else f'({asked.text})'} {{")
        self._block(node.body)
        if node.orelse:
            self._line("} else {")
            self._block(node.orelse)
        self._line("}")

    def _for(self, node: Any) -> None:
        limits = [self._text(each) for each in node.iter.args]
        first, last = limits[:2] if len(limits) > 1 else ("0", limits[0])
        index = "rounds" if node.target.id == "_" else node.target.id
        self._declare(index, Scalar(index, "int"))
        until, on = (">", "--") if len(limits) > 2 else ("<", "++")
        self._line(f"for ({index} = {first}; {index} {until} {last}; {on}{index}) {{")
        self._block(node.body)
        self._line("}")

    def _return(self, node: ast.Return) -> None:
        if node.value is None:
            self._line("return;")
            return
        value = self._value(node.value)
        if isinstance(value, tuple) and not isinstance(value, LEAVES):
            self._returned(value)
            self._line("return;")
        else:
            self.result = Scalar("", kind_of(value)[0])
            self._line(f"return {self._of(value)};")

    def _assign(self, node: ast.Assign) -> None:
        self._put(node.targets[0], self._value(node.value))

    def _augassign(self, node: Any) -> None:
        self._put(node.target, self._value(ast.BinOp(node.target, node.op, node.value)))

    def _put(self, target: Any, value: Any) -> None:
        """Assign a value to names and places, all at once."""
        pairs = (
            [(target, value)]
            if not isinstance(target, ast.Tuple)
            else list(zip(target.elts, value, strict=True))
        )
        if len(pairs) > 1 and self._depend(pairs):
            pairs = [(each, mapped(part, self._kept)) for each, part in pairs]
        for each, part in pairs:
            if not isinstance(each, ast.Name):
                self._line(f"{self._text(each)} = {self._of(part)};")
            elif isinstance(part, (Array, CStruct)):
                self.names[each.id] = part
            elif each.id != "_":
                self._assigned(each.id, part)

    def _depend(self, pairs: list[tuple[Any, Any]]) -> bool:
        """Return True if a value is read after what it depends on is assigned."""
        done: list[str] = []
        for target, value in pairs:
            texts = " ".join(self._of(each) for each in leaves(value))
            if any(re.search(rf"\b{re.escape(each)}", texts) for each in done):
                return True
            done.append(
                target.id
                if isinstance(target, ast.Name)
                else self._of(self._value(target.value))
            )
        return False

    def _assigned(self, name: str, value: Any) -> None:
        parts = list(leaves(value))
        count = iter(range(len(parts)))
        self._declare(
            name,
            mapped(
                value,
                lambda each: Scalar(
                    name if len(parts) == 1 else f"{name}_{next(count)}",
                    kind_of(each)[0],
                ),
            ),
        )
        for own, each in zip(leaves(self.names[name]), parts, strict=True):
            self._line(f"{own.text} = {self._of(each)};")

    def _declare(self, name: str, value: Any) -> None:
        if name not in self.names:
            self.names[name] = value
            self.locals |= {each.text: each.kind for each in leaves(value)}

    def _kept(self, value: Any) -> Any:
        """Return a number under a name of its own, if it may change."""
        if not isinstance(value, Scalar) or not re.search("[a-z]", value.text):
            return value
        name = f"t{len(self.lines)}"
        self._line(f"const {value.kind} {name} = {value.text};")
        return value._replace(text=name)

    # ------------------------------------------------------------------ expressions

    def _text(self, node: Any) -> str:
        return self._of(self._value(node))

    def _value(self, node: Any) -> Any:
        return getattr(self, f"_value_of_{type(node).__name__.lower()}")(node)

    def _value_of_constant(self, node: ast.Constant) -> Any:
        return node.value

    def _value_of_name(self, node: ast.Name) -> Any:
        return self.names.get(
            node.id, self.space.get(node.id, getattr(builtins, node.id, None))
        )

    def _value_of_attribute(self, node: ast.Attribute) -> Any:
        own = self._value(node.value)
        if not isinstance(own, CStruct):
            return getattr(own, node.attr)
        kind = own.kind[node.attr]
        name = f"{own.text}->{node.attr}"
        number = "real" if kind.base.kind == "f" else "int"
        return Array(name, kind.shape, number) if kind.shape else Scalar(name, number)

    def _value_of_tuple(self, node: ast.Tuple) -> Any:
        return tuple(self._value(each) for each in node.elts)

    def _value_of_subscript(self, node: ast.Subscript) -> Any:
        own = self._value(node.value)
        last = getattr(node.slice, "elts", [node.slice])[-1]
        parts = [
            *getattr(node.slice, "elts", [node.slice])[:-1],
            last.lower if isinstance(last, ast.Slice) else last,
        ]
        places = [self._value(each) for each in parts]
        if not isinstance(own, Array):
            return own[places[0]]
        if own.kind in self.loops.structs:
            return CStruct(f"({own.text} + {self._of(places[0])})", own.kind)
        rest = own.shape[len(places) :]
        if isinstance(last, ast.Slice):
            end = own.shape[-1] if last.upper is None else self._value(last.upper)
            rest = (end - places[-1],)
        lengths = (math.prod(own.shape[i + 1 :]) for i in range(len(places)))
        terms = [
            self._of(each) if n == 1 else f"{n} * {self._of(each)}"
            for each, n in zip(places, lengths, strict=True)
        ]
        at = " + ".join(terms)
        return (
            own._replace(text=f"({own.text} + {at})", shape=rest)
            if rest
            else Scalar(f"{own.text}[{at}]", own.kind)
        )

    def _value_of_unaryop(self, node: ast.UnaryOp) -> Any:
        value = self._value(node.operand)
        text, function = _OPERATORS[type(node.op)]
        if not isinstance(value, Scalar):
            return function(plain(value))
        return Scalar(f"({text}{value.text})", value.kind)

    def _value_of_binop(self, node: ast.BinOp) -> Any:
        a = self._value(node.left)
        b = self._value(node.right)
        if isinstance(node.op, ast.Pow):
            if plain(b) != 2:
                raise NotImplementedError(
                    f"power {b} in {self.name}: squares alone are translated"
                )
            a = self._kept(a)
            return Scalar(f"({a.text} * {a.text})")
        return self._joined(type(node.op), a, b)

    def _joined(self, operation: type, a: Any, b: Any) -> Any:
        kinds = {kind_of(a)[0], kind_of(b)[0]}
        (text, function) = _OPERATORS[operation]
        if not isinstance(a, Scalar) and not isinstance(b, Scalar):
            return function(plain(a), plain(b))
        if "real" in kinds:
            a, b = (
                each if isinstance(each, Scalar) else float(plain(each))
                for each in (a, b)
            )
        compares = issubclass(operation, ast.cmpop) or "real" not in kinds
        return Scalar(
            f"({self._of(a)} {text} {self._of(b)})", "int" if compares else "real"
        )

    def _value_of_compare(self, node: ast.Compare) -> Any:
        if isinstance(node.ops[0], ast.In):
            left = self._text(node.left)
            own = self._value(node.comparators[0])
            return Scalar(
                f"({' || '.join(f'{left} == {self._of(each)}' for each in own)})", "int"
            )
        parts = [self._value(each) for each in (node.left, *node.comparators)]
        pairs = zip(parts, node.ops, parts[1:], strict=False)
        found = [self._joined(type(operation), a, b) for a, operation, b in pairs]
        return (
            found[0]
            if len(found) == 1
            else Scalar(f"({' && '.join(map(self._of, found))})", "int")
        )

    def _value_of_boolop(self, node: ast.BoolOp) -> Any:
        text = " && " if isinstance(node.op, ast.And) else " || "
        return Scalar(f"({text.join(map(self._text, node.values))})", "int")

    def _value_of_ifexp(self, node: ast.IfExp) -> Any:
        asked = self._kept(self._value(node.test))
        if not isinstance(asked, Scalar):
            return self._value(node.body if asked else node.orelse)
        yes = self._value(node.body)
        no = self._value(node.orelse)
        others = iter(list(leaves(no)))
        return mapped(
            yes, lambda each: self._chosen(self._of(asked), each, next(others))
        )

    def _chosen(self, asked: str, a: Any, b: Any) -> Scalar:
        return Scalar(f"({asked} ? {self._of(a)} : {self._of(b)})", kind_of(a)[0])

    def _value_of_call(self, node: ast.Call) -> Any:
        function = self._value(node.func)
        given = tuple(map(self._value, node.args))
        if function in _LARGER:
            a, b = (self._kept(each) for each in given)
            return self._chosen(
                f"{self._of(a)} {_LARGER[function]} {self._of(b)}", a, b
            )
        if (
            function is abs
            or getattr(math, getattr(function, "__name__", ""), None) is function
        ):
            name = "fabs" if function is abs else function.__name__
            return Scalar(
                f"{name}{self.loops.writer.suffix}({', '.join(map(self._of, given))})"
            )
        if isinstance(function, type):
            return function(*given)
        if function is at:
            return given[0]._replace(text=f"({given[0].text} + {self._of(given[1])})")
        if function is np.empty:
            name = f"a{len(self.locals)}"
            self.locals[f"{name}[{given[0]}]"] = "real"
            return Array(name, (plain(given[0]),))
        name, taken, result = self.loops.add(function, given)
        texts = [
            self._of(each)
            for each, wanted in zip(leaves(given), taken, strict=True)
            if wanted
        ]
        if isinstance(result, Scalar):
            return Scalar(f"{name}({', '.join(texts)})", result.kind)
        if result is None:
            self._line(f"{name}({', '.join(texts)});")
            return None
        own = f"r{len(self.lines)}"
        self.locals[f"{own}[{len(list(leaves(result)))}]"] = "real"
        self._line(f"{name}({', '.join([*texts, own])});")
        return mapped(
            result, lambda each: each._replace(text=each.text.replace("result", own))
        )
