"""Traces of functions that write to lists."""

from planarfriction._engine.codegen import operators
from planarfriction._engine.codegen.trace import Branch, Number, Trace


def test_lists_are_written_once():
    """A function that is run again for each answer begins with the list that it was given."""

    def function(x, row):
        row[0] = row[0] + x
        row[1] = row[0] if x > 0.0 else 1.0
        return row[0]

    trace = Trace()
    x = Number(trace, "x")
    row = [x, 0.0]
    doubled = trace.call(function, (x, row))
    total, _, branch = trace.operations
    assert (total.operator, total.arguments) == (operators.ADD, ("x", "x"))
    assert row[0].name == doubled.name == total.name
    assert isinstance(branch, Branch) and branch.outcomes == ((row[1].name, "real"),)
    assert (branch.yes.results, branch.no.results) == ((total.name,), (1.0,))


def test_calls_are_traced_once():
    """A function that asks what another function's branch gave goes on with the names that it has."""

    def inner(x):
        return x * 2.0 if x > 0.0 else 3.0

    def outer(x):
        return 1.0 if trace.call(inner, (x,)) > 5.0 else 0.0

    trace = Trace()
    x = Number(trace, "x")
    result = trace.call(outer, (x,))
    _, first, _, second = trace.operations
    assert first.outcomes[0][0] in trace.operations[2].arguments
    assert second.outcomes == ((result.name, "real"),)
