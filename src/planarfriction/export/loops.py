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
import re
import textwrap
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from planarfriction.compiler import compiled_math
from planarfriction.export.c_source import Writer


class Scalar(NamedTuple):
    """A number in C."""

    text: str
    kind: str = "real"
    """"real" or "int"."""


class Fixed(NamedTuple):
    """A number that every function knows, so that none takes it as an argument."""

    value: float


class Array(NamedTuple):
    """An array in C, by the expression of its first number."""

    text: str
    shape: tuple[int, ...]
    kind: str = "real"
    fixed: bool = False
    """True for a table of the source, which no function takes as an argument."""


_OPERATORS: dict[type, str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.USub: "-", ast.Not: "!", ast.And: "&&", ast.Or: "||",
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip

_LARGER = {min: "<", builtins.max: ">", compiled_math.minimum: "<", compiled_math.maximum: ">"}


class Loops:
    """Source of C functions, each in front of those that call it."""

    def __init__(self, writer: Writer) -> None:
        self.writer = writer
        self.functions: list[str] = []
        self._made: dict[Any, tuple[str, list[bool], Any]] = {}

    def add(self, kernel: Any, arguments: tuple[Any, ...]) -> tuple[str, list[bool], Any]:
        """Write a kernel for arguments like these; return its name, which of their numbers it takes, and its result."""
        key = kernel, _kinds(arguments)
        if key not in self._made:
            own = _Function(self, kernel, arguments)
            self.functions.append(own.source)
            self._made[key] = own.name, own.taken, own.result
        return self._made[key]


def leaves(value: Any) -> Iterator[Any]:
    """Yield the numbers and arrays of nested records."""
    if isinstance(value, tuple) and not isinstance(value, (Scalar, Fixed, Array)):
        for each in value:
            yield from leaves(each)
    else:
        yield value


def _mapped(value: Any, change: Callable[[Any], Any]) -> Any:
    """Return nested records with their leaves changed, in order."""
    if isinstance(value, tuple) and not isinstance(value, (Scalar, Fixed, Array)):
        items = [_mapped(each, change) for each in value]
        return type(value)(*items) if hasattr(value, "_fields") else tuple(items)
    return change(value)


def _kinds(value: Any) -> Any:
    """Return what tells functions of such arguments apart."""
    return tuple(
        each if isinstance(each, Fixed) or getattr(each, "fixed", False) else _kind(each) for each in leaves(value)
    )


def _kind(value: Any) -> Any:
    if isinstance(value, (Scalar, Array)):
        return value.kind, getattr(value, "shape", None)
    return "real" if isinstance(getattr(value, "value", value), float) else "int", None


class _Function:
    """One kernel as a C function."""

    def __init__(self, loops: Loops, kernel: Any, arguments: tuple[Any, ...]) -> None:
        own = kernel.py_func
        self.loops, self.space, self.lines, self.locals = loops, own.__globals__, [], {}
        self.name = f"{own.__module__.rpartition('.')[2]}_{own.__name__.strip('_')}"
        tree: Any = ast.parse(textwrap.dedent(inspect.getsource(own))).body[0]
        parameters, self.result, self.indent = [], None, "    "
        self.names: dict[str, Any] = {}
        for argument, value in zip(tree.args.args, arguments, strict=True):
            self.names[argument.arg] = self._parameter(argument.arg, value, parameters)
        for statement in tree.body:
            self._do(statement)
        body = "\n".join(self.lines)
        self.taken = [text is not None and bool(re.search(rf"\b{name}\b", body)) for name, text in parameters]
        head = [text for (_, text), taken in zip(parameters, self.taken, strict=True) if taken]
        kind = "void" if self.result is None else self.result.kind if isinstance(self.result, Scalar) else "void"
        head += ["real *result"] if isinstance(self.result, tuple) and kind == "void" else []
        declared = []
        for each in ("real", "int"):
            names = [name for name, own in self.locals.items() if own == each]
            declared += [f"    {each} {', '.join(names)};"] if names else []
        lines = self.lines[: -1 if self.lines[-1] == "    return;" else None]
        self.source = "\n".join([f"static {kind} {self.name}({', '.join(head)})", "{", *declared, *lines, "}"])

    def _parameter(self, name: str, value: Any, parameters: list[tuple[str, str | None]]) -> Any:
        count = len(list(leaves(value)))

        def named(each: Any) -> Any:
            place = len(parameters) - first
            own = name if count == 1 else f"{name}_{place}"
            if isinstance(each, Fixed) or getattr(each, "fixed", False):
                parameters.append((own, None))
                return each
            kind, _ = _kind(each)
            parameters.append((own, f"{kind} {'*' if isinstance(each, Array) else ''}{own}"))
            return each._replace(text=own) if isinstance(each, Array) else Scalar(own, kind)

        first = len(parameters)
        return _mapped(value, named)

    # ------------------------------------------------------------------ statements

    def _line(self, text: str) -> None:
        self.lines.append(self.indent + text)

    def _block(self, statements: list[ast.stmt]) -> None:
        self.indent += "    "
        for each in statements:
            self._do(each)
        self.indent = self.indent[4:]

    def _do(self, node: Any) -> None:
        getattr(self, f"_{type(node).__name__.lower()}")(node)

    def _expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Call):
            self._value(node.value)

    def _break(self, node: ast.Break) -> None:
        self._line("break;")

    def _if(self, node: ast.If) -> None:
        self._line(f"if ({self._text(node.test)}) {{")
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
        down = len(limits) > 2
        self._line(
            f"for ({index} = {first}; {index} {'>' if down else '<'} {last}; {'--' if down else '++'}{index}) {{"
        )
        self._block(node.body)
        self._line("}")

    def _return(self, node: ast.Return) -> None:
        if node.value is None:
            self._line("return;")
            return
        value = self._value(node.value)
        parts = list(leaves(value))
        if isinstance(value, tuple) and not isinstance(value, (Scalar, Fixed)):
            places = iter(f"result[{i}]" for i in range(len(parts)))
            for i, each in enumerate(parts):
                self._line(f"result[{i}] = {self._of(each)};")
            self.result = _mapped(value, lambda _: Scalar(next(places)))
            self._line("return;")
        else:
            self.result = Scalar("", _kind(value)[0])
            self._line(f"return {self._of(value)};")

    def _assign(self, node: ast.Assign) -> None:
        self._put(node.targets[0], self._value(node.value))

    def _augassign(self, node: Any) -> None:
        self._put(node.target, self._value(ast.BinOp(node.target, node.op, node.value)))

    def _put(self, target: Any, value: Any) -> None:
        """Assign a value to names and places, all at once."""
        pairs = [(target, value)] if not isinstance(target, ast.Tuple) else list(zip(target.elts, value, strict=True))
        if len(pairs) > 1 and self._depend(pairs):
            pairs = [(each, _mapped(part, self._kept)) for each, part in pairs]
        for each, part in pairs:
            if isinstance(each, ast.Subscript):
                self._line(f"{self._text(each)} = {self._of(part)};")
            elif isinstance(part, Array):
                self.names[each.id] = part
            else:
                self._assigned(each.id, part)

    def _depend(self, pairs: list[tuple[Any, Any]]) -> bool:
        """Return True if a value is read after what it depends on is assigned."""
        done: list[str] = []
        for target, value in pairs:
            texts = " ".join(self._of(each) for each in leaves(value))
            if any(re.search(rf"\b{re.escape(each)}", texts) for each in done):
                return True
            done.append(target.id if isinstance(target, ast.Name) else self._of(self._value(target.value)))
        return False

    def _assigned(self, name: str, value: Any) -> None:
        parts = list(leaves(value))
        count = iter(range(len(parts)))
        self._declare(
            name,
            _mapped(value, lambda each: Scalar(name if len(parts) == 1 else f"{name}_{next(count)}", _kind(each)[0])),
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

    def _of(self, value: Any) -> str:
        return value.text if isinstance(value, (Scalar, Array)) else self.loops.writer.constant(_plain(value))

    def _text(self, node: Any) -> str:
        return self._of(self._value(node))

    def _value(self, node: Any) -> Any:
        return getattr(self, f"_value_of_{type(node).__name__.lower()}")(node)

    def _value_of_constant(self, node: ast.Constant) -> Any:
        return node.value

    def _value_of_name(self, node: ast.Name) -> Any:
        return self.names.get(node.id, self.space.get(node.id, getattr(builtins, node.id, None)))

    def _value_of_attribute(self, node: ast.Attribute) -> Any:
        return getattr(self._value(node.value), node.attr)

    def _value_of_tuple(self, node: ast.Tuple) -> Any:
        return tuple(self._value(each) for each in node.elts)

    def _value_of_subscript(self, node: ast.Subscript) -> Any:
        own = self._value(node.value)
        places = [self._value(each) for each in getattr(node.slice, "elts", [node.slice])]
        if not isinstance(own, Array):
            return own[places[0]]
        at, rest = "", own.shape[len(places) :]
        for place, length in zip(places, (*own.shape[1:], 1), strict=False):
            at = f"({at}{self._of(place)}) * {length}" if length > 1 else f"{at}{self._of(place)}"
            at += " + " if place is not places[-1] else ""
        return own._replace(text=f"({own.text} + {at})", shape=rest) if rest else Scalar(f"{own.text}[{at}]", own.kind)

    def _value_of_unaryop(self, node: ast.UnaryOp) -> Any:
        value = self._value(node.operand)
        if not isinstance(value, Scalar):
            return -_plain(value)
        return Scalar(f"({_OPERATORS[type(node.op)]}{value.text})", value.kind)

    def _value_of_binop(self, node: ast.BinOp) -> Any:
        a, b = self._value(node.left), self._value(node.right)
        if isinstance(node.op, ast.Pow):
            a = self._kept(a)
            return Scalar(f"({a.text} * {a.text})")
        return self._joined(type(node.op), a, b)

    def _joined(self, operator: type, a: Any, b: Any) -> Any:
        kinds = {_kind(a)[0], _kind(b)[0]}
        if not isinstance(a, Scalar) and not isinstance(b, Scalar):
            code = compile(ast.fix_missing_locations(ast.Expression(ast.BinOp(
                ast.Constant(_plain(a)), operator(), ast.Constant(_plain(b))))), "", "eval")  # fmt: skip
            return eval(code)
        if "real" in kinds:
            a, b = (float(_plain(each)) if not isinstance(each, Scalar) else each for each in (a, b))
        return Scalar(f"({self._of(a)} {_OPERATORS[operator]} {self._of(b)})", "real" if "real" in kinds else "int")

    def _value_of_compare(self, node: ast.Compare) -> Any:
        parts = [self._value(each) for each in (node.left, *node.comparators)]
        pairs = zip(parts, node.ops, parts[1:], strict=False)
        texts = [self._joined(type(operator), a, b).text for a, operator, b in pairs]
        return Scalar(" && ".join(texts), "int") if len(texts) == 1 else Scalar(f"({' && '.join(texts)})", "int")

    def _value_of_boolop(self, node: ast.BoolOp) -> Any:
        return Scalar(f"({f' {_OPERATORS[type(node.op)]} '.join(map(self._text, node.values))})", "int")

    def _value_of_ifexp(self, node: ast.IfExp) -> Any:
        asked, yes, no = self._kept(self._value(node.test)), self._value(node.body), self._value(node.orelse)
        others = iter(list(leaves(no)))
        return _mapped(yes, lambda each: self._chosen(self._of(asked), each, next(others)))

    def _chosen(self, asked: str, a: Any, b: Any) -> Scalar:
        return Scalar(f"({asked} ? {self._of(a)} : {self._of(b)})", _kind(a)[0])

    def _value_of_call(self, node: ast.Call) -> Any:
        function, given = self._value(node.func), tuple(map(self._value, node.args))
        if function in _LARGER:
            a, b = (self._kept(each) for each in given)
            return self._chosen(f"{self._of(a)} {_LARGER[function]} {self._of(b)}", a, b)
        if function is abs or getattr(math, getattr(function, "__name__", ""), None) is function:
            name = "fabs" if function is abs else function.__name__
            return Scalar(f"{name}{self.loops.writer.suffix}({', '.join(map(self._of, given))})")
        if isinstance(function, type):
            return function(*given)
        name, taken, result = self.loops.add(function, given)
        texts = [self._of(each) for each, wanted in zip(leaves(given), taken, strict=True) if wanted]
        if isinstance(result, Scalar):
            return Scalar(f"{name}({', '.join(texts)})", result.kind)
        if result is None:
            self._line(f"{name}({', '.join(texts)});")
            return None
        own = f"r{len(self.lines)}"
        self.locals[f"{own}[{len(list(leaves(result)))}]"] = "real"
        self._line(f"{name}({', '.join([*texts, own])});")
        return _mapped(result, lambda each: each._replace(text=each.text.replace("result", own)))


def _plain(value: Any) -> Any:
    return value.value if isinstance(value, Fixed) else value
