"""Models taken apart for source code: their numbers as tables, and the traced step of one cell."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from types import CellType, FunctionType, SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from planarfriction import formulas
from planarfriction._engine.bristles import discs, elastic, points
from planarfriction._engine.bristles.elastic import Elastic
from planarfriction._engine.bristles.law import inverse_deflection
from planarfriction._engine.cells import cells_rollout
from planarfriction._engine.cells.cell_loops import KINDS
from planarfriction._engine.codegen.derivatives import derive
from planarfriction._engine.codegen.ratios import ratio
from planarfriction._engine.codegen.rebinding import Rewriting
from planarfriction._engine.codegen.symbolic_functions import (
    NAMES,
    SYMBOLS,
    finished,
    twin,
)
from planarfriction._engine.codegen.trace import (
    Block,
    Mathematics,
    Number,
    Table,
    Trace,
    traced,
)
from planarfriction._engine.codegen.vectors import norm, times
from planarfriction._engine.published import published_contact, published_step
from planarfriction._engine.published.published_contact import (
    PublishedContact,
    PublishedPatch,
    Root,
)
from planarfriction._engine.published.surfaces import CELLS
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.laws.base import is_rate_law
from planarfriction.models import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.models.base import refuse_common
from planarfriction.patch import ContactPatch
from planarfriction.patch.shared import loads_of_change

ERROR = 2e-3
"""Largest share of the load that stands on other cells than it should, halfway between two rungs [-]."""

MOST_RUNGS = 512

NARROW = 1e-3
"""Relative distance of rungs [-] between which nothing is put: a shape that jumps there stays as it is."""


class Ladder(NamedTuple):
    """Shares of the load at some loads, linear in the load between them and constant beyond."""

    rungs: np.ndarray
    """Loads [L] [N]."""
    shares: np.ndarray
    """Shares of the cells [L, N]."""


def ladder_of(patch: ContactPatch) -> Ladder:
    """Return rungs so close that shares between them err by `ERROR` at most, or `NARROW` ones where shares jump.

    Raises InvalidValueError if more than `MOST_RUNGS` are needed.
    """
    rungs = np.union1d(loads_of_change(patch), getattr(patch.pressure, "loads", ()))
    while True:
        shares = patch.weights(rungs)
        between = 0.5 * (rungs[1:] + rungs[:-1])
        off = 0.5 * np.abs(
            patch.weights(between) - 0.5 * (shares[1:] + shares[:-1])
        ).sum(axis=1)
        coarse = (off > ERROR) & (np.diff(rungs) > NARROW * between)
        if not coarse.any():
            return Ladder(rungs, shares)
        rungs = np.union1d(rungs, between[coarse])
        if len(rungs) > MOST_RUNGS:
            rule = (
                f"have a patch whose shape {MOST_RUNGS} loads describe within {ERROR:g}"
            )
            raise InvalidValueError("model", rule, patch.name or "a patch")


FIXED = "gamma", "elasto_plastic", "creep_speed"
"""Numbers of a law that are constants of the source: stored maps and the shape of the code depend on them."""


class Pieces(NamedTuple):
    """A model as source code needs it: `count` cells that see the same twist and share the load."""

    count: int
    states: int
    """Number of states of a cell; the first of all cells come first."""
    tables: dict[str, np.ndarray]
    """Constant arrays by name; `share` [count] is that in the load, `place_x` and `place_y` are those of its parts,
    which in single precision nothing else reads."""
    step: Block
    """New states, then the wrench per unit load, from `p`, `k`, `z`, `v`, `dt`; of a pad `shares`, `normal_force`."""
    parameters: dict[str, float]
    """Numbers of the law that may change at run time."""
    steady: Block
    """Wrench of steady sliding per unit load."""
    slopes: Callable[[], Block]
    """Trace new states, wrench and derivatives: rows of the wrench, then of states.

    Derivatives are by states, twist, parameters and, of a pad, by the load of the cell, which is `carried`."""
    turns: Callable[[], Block] | None = None
    """Trace the wrench per unit load and, row by row, its derivatives by the twist."""
    rungs: int = 0
    """Number of loads, the table `rungs`, that `share` [rungs, count] is for; 0 for a fixed shape."""
    pad: bool = False
    """True for pieces of a pad, which see their loads."""
    moves: bool = False
    """True if the patch moves where pressures that follow moments cannot be had by other shares."""
    face: bool = False
    """True for pieces of a pad with a compliance in common: three states of its face follow those of the cells."""

    @property
    def columns(self) -> int:
        """Number of derivatives of a number of a cell."""
        return self.states + 3 + len(self.parameters) + self.pad

    @property
    def all_states(self) -> int:
        """Number of states of all cells and of the face."""
        return self.count * self.states + 3 * self.face


def pieces_of(
    model: Any, precision: str = "double", *, fixed: bool = True, count: int = 0
) -> Pieces:
    """Take a model apart for a `precision` of `library.PRECISIONS`.

    Only one of a `fixed` shape without a face, or also cells whose pressure follows the load, and pads with a common
    compliance. If it has fewer cells than `count`, others without load follow.

    Raises InvalidValueError for models without straight-line source: laws of the user's own, other patches whose shape
    depends on the load, friction that differs from cell to cell in other ways than by a metric.
    """
    whole = model.reduction if isinstance(model, ReducedModel) else model
    law = getattr(model, "law", None)
    for kind, taken_apart in _KINDS.items():
        if (
            type(whole) is kind
            and isinstance(getattr(law, "numbers", None), LawNumbers)
            and not is_rate_law(law)
        ):
            if whole.patch.depends_on_load and (fixed or kind is not DistributedModel):
                rule = "have a patch whose shape does not depend on the load" + (
                    "" if fixed else ", or cells"
                )
                raise InvalidValueError(
                    "model", rule, model.patch.name or "a patch that does"
                )
            if fixed:
                refuse_common(whole, "Warp")
            return taken_apart(whole, precision, count)
    names = ", ".join(kind.__name__ for kind in (*_KINDS, ReducedModel))
    given = f"{type(model).__name__}, {type(law).__name__}"
    raise InvalidValueError(
        "model", f"be one of {names} with a law of LuGre bristles", given
    )


# ---------------------------------------------------------------------- what they are traced with


def _law(trace: Trace, numbers: LawNumbers, more: tuple[str, ...] = ()) -> LawNumbers:
    symbols: dict[str, Any] = {
        name: Number(trace, f"p->{name}")
        for name in LawNumbers._fields
        if name not in FIXED + more
    }
    return numbers._replace(**symbols)


def _parameters(numbers: LawNumbers, more: tuple[str, ...] = ()) -> dict[str, float]:
    """Return the numbers of a law that are not constants of the source, `more` of which are."""
    names = [name for name in LawNumbers._fields if name not in FIXED + more]
    if not numbers.elasto_plastic:
        names.remove("breakaway_ratio")
    return {name: float(getattr(numbers, name)) for name in names}


def _vector(trace: Trace, *names: str) -> tuple[Any, ...]:
    return tuple(Number(trace, name) for name in names)


def _state(trace: Trace, states: int, count: int) -> tuple[Any, ...]:
    return _vector(trace, *(f"z[k + {i * count}]" for i in range(states)))


_TWIST = "v[0]", "v[1]", "v[2]"


# ---------------------------------------------------------------------- kinds of models


def _sliding(u: Any) -> Any:
    """Return what `discs.sliding` does, of a point."""
    return 1.0, 1.0, 0.0, norm(u), u


def _sliding_of_disc(u: Any) -> Any:
    """Return what `discs.sliding` does, in a unit of speed whose fourth powers do not leave single precision."""
    slide = u[0] * u[0] + u[1] * u[1]
    spin = 2.0 * u[2] * u[2]
    per = 1.0 / (slide + spin + math.sqrt(formulas.DISC_REST))
    c_t, c_s, m, across = formulas.disc_friction_above(
        per * slide, per * spin, formulas.DISC_REST * per * per
    )
    pull = c_t * u[0], c_t * u[1], c_s * u[2]
    return c_t, c_s, across, math.sqrt(slide + m * spin), pull


def _with(function: Any, **others: Any) -> Any:
    """Return a function that calls others in place of those of its module or of those around it."""
    own = function.py_func
    around = zip(own.__code__.co_freevars, own.__closure__ or (), strict=True)
    cells = [CellType(others.get(name, cell.cell_contents)) for name, cell in around]
    return FunctionType(
        own.__code__, own.__globals__ | others, own.__name__, None, tuple(cells)
    )


LIGHTEST = 1e-6
"""Takes the place of `formulas.LIGHTEST` for pads in single precision, whose range of numbers is short."""

_FACTORS = _with(elastic.factors, formulas=SimpleNamespace(LIGHTEST=LIGHTEST))


def _cell(size: int, pad: bool, precision: str) -> tuple[Any, Any, Any]:
    """Return the step of a cell, of a piece of a pad if it is one, that of the law alone, and `discs.sliding`."""
    module = discs if size == 3 else points
    sliding = _sliding if size == 2 else discs.sliding
    moved = module.moved
    plain = module.step
    step = elastic.step_disc if size == 3 else elastic.step
    if precision == "float":
        if size == 3:
            sliding = _sliding_of_disc
            moved = _with(moved, sliding=sliding)
            plain = _with(plain, moved=moved)
        step = _with(step, moved=moved, factors=_FACTORS)
    return step if pad else plain, plain, sliding


def _distributed(model: DistributedModel, precision: str, count: int) -> Pieces:
    if model.patch.asymmetry is not None:
        raise InvalidValueError("model", "have no asymmetry", model.patch.asymmetry)
    numbers = model.compiled.numbers()
    law = model.law.numbers
    size = model.compiled.size
    kind = KINDS[size, model.patch.anisotropic, model.compiled.sort]
    more = max(count - model.patch.cells, 0)
    n = model.patch.cells + more
    cell, plain, sliding = _cell(size, kind.pad, precision)
    face = model.compiled.compliance is not None
    # Pads whose stiffness is their own do not feel sigma_0, and behind a common compliance nothing damps.
    constant = ("sigma_0",) * (not model.compiled.springs) + ("sigma_1",) * face
    parameters = _parameters(law, constant)
    by = cells_rollout.by_of(kind.path, kind.pad)
    lever = twin(kind.lever)
    names = ["place_x", "place_y"] if precision == "double" else ["lever_x", "lever_y"]
    if model.patch.anisotropic:
        names = ["lever_xx", "lever_xy", "lever_yy", "lever_x", "lever_y"]
    names += ["gyration"] * (size == 3)

    def given(trace: Trace, load: str) -> tuple[Any, Any, Any]:
        """Return the numbers of the lever, the law of the cell under its load or a share of all, and its velocity."""
        own = _vector(trace, *(f"{name}[k]" for name in names))
        found: Any = _law(trace, law, constant)
        if kind.pad:
            found = Elastic(found, *_vector(trace, "stiff[k]", load))
            if load == "normal_force":
                found = found._replace(load=Number(trace, "shares[k]") * found.load)
        return own, found, lever.seen(own, _vector(trace, *_TWIST))

    def step(trace: Trace) -> Any:
        own, found, u = given(trace, "normal_force")
        dt = Number(trace, "dt")
        new, traction = twin(cell)(found, _state(trace, size, n), u, dt)
        return new, lever.wrench(own, traction)

    def steady(trace: Trace) -> Any:
        own, found, u = given(trace, "normal_force")
        found = found.law if kind.pad else found
        speed, pull = twin(sliding)(u)[3:]
        z = twin(times)(
            twin(ratio)(1.0, speed * twin(inverse_deflection)(found, speed)), pull
        )
        return lever.wrench(own, twin(plain)(found, z, u, 0.0)[1])

    def slopes(trace: Trace, turns: bool = False) -> Any:
        own, found, u = given(trace, "normal_force" if turns else "carried")
        written = derive(cell, by, {"z": size, "u": size})
        forth = twin(written.forth)
        back = twin(written.back)
        none = (0.0,) * size
        inputs = found, _state(trace, size, n), u, Number(trace, "dt")
        (new, traction), tape = forth(*inputs)
        bars = [
            back(tape, (none, lever.seen(own, unit))) for unit in np.eye(3).tolist()
        ]
        if turns:
            return tuple(
                lever.wrench(own, each)
                for each in (traction, *(bar[1] for bar in bars))
            )
        bars += [back(tape, (tuple(unit), none)) for unit in np.eye(size).tolist()]
        kept = [cells_rollout.PARAMETERS.index(name) for name in parameters]
        kept += [-1] * kind.pad
        rows = tuple(
            (by_z, lever.wrench(own, by_u), *(by_law[i] for i in kept))
            for by_z, by_u, *by_law in bars
        )
        return new, lever.wrench(own, traction), rows

    places = zip(
        ("place_x", "place_y", *names),
        (*model.patch.positions.T, *numbers),
        strict=False,
    )
    tables = dict(places)
    tables |= {"stiff": model.compiled.stiff} if kind.pad else {}
    tables = {
        name: np.pad(each, (0, more), mode="edge") for name, each in tables.items()
    }
    rungs = 0
    if model.patch.depends_on_load:
        ladder = ladder_of(model.patch)
        tables |= {"share": ladder.shares, "rungs": ladder.rungs}
        rungs = len(ladder.rungs)
    else:
        tables["share"] = np.pad(model.patch.weights(), (0, more))
    return Pieces(
        n,
        size,
        tables,
        traced(step),
        parameters,
        traced(steady),
        lambda: traced(slopes),
        lambda: traced(functools.partial(slopes, turns=True)),
        rungs,
        kind.pad,
        face=face,
    )


def _published(model: ReducedModelPublished, *_: Any) -> Pieces:
    """Trace the steps of the record of the contact."""
    found = model.compiled.shapes.shape_at(None)
    law = model.law.numbers
    surface = found.surface.numbers
    root = found.root
    shape = PublishedPatch(*found.numbers)
    if surface.kind == CELLS:
        raise InvalidValueError(
            "surface", "be an ellipsoid or a table", type(found.surface).__name__
        )
    root = Root(float(root[0, 0]), float(root[0, 1]), float(root[1, 1]))
    steps = Rewriting(
        (*SYMBOLS, (published_contact.read, lambda record: record)), NAMES, finished
    )(published_step)

    def contact(trace: Trace) -> PublishedContact:
        data: Any = Table(trace, "surface", surface.data)
        return PublishedContact(
            _law(trace, law), shape, root, surface.kind, surface.size, data
        )

    def step(trace: Trace) -> Any:
        new = [0.0] * 3
        out = [0.0] * 3
        dt = Number(trace, "dt")
        steps.step(
            contact(trace), _state(trace, 3, 1), _vector(trace, *_TWIST), dt, new, out
        )
        return tuple(new), tuple(out)

    def steady(trace: Trace) -> Any:
        own, part = steps.read(contact(trace))
        held = steps.hold(part, steps.seen(own, _vector(trace, *_TWIST)))
        q = part.law.sigma_0 / twin(formulas.stribeck)(Mathematics, held.v, part.law)
        x, y, s = twin(times)(twin(ratio)(1.0, q * held.v), held.u)
        settled = x, y, part.shape.contact_radius * s
        wrench = steps.wrench_of(own, steps.taped_step(part, held, settled, 0.0).wrench)
        return tuple(Mathematics.where(held.v > 0.0, each, 0.0) for each in wrench)

    def slopes(trace: Trace) -> Any:
        laws: list[LawNumbers] = []

        def pull_back(*arguments: Any) -> Any:
            bar = steps.pull_back(*arguments)
            laws.append(bar.law)
            return bar

        new = [0.0] * 3
        out = [0.0] * 39
        dt = Number(trace, "dt")
        given = (
            contact(trace),
            _state(trace, 3, 1),
            _vector(trace, *_TWIST),
            dt,
            new,
            out,
        )
        steps.slopes(*given, pull_back=pull_back, whole=True)
        by_law = [
            tuple(getattr(each, name) for name in _parameters(law)) for each in laws
        ]
        rows = [
            (*out[at + 18 : at + 21], *out[at : at + 3], bar)
            for at, bar in zip(range(3, 21, 3), by_law, strict=True)
        ]
        return tuple(new), tuple(out[:3]), tuple(rows)

    tables: dict[str, Any] = {
        "place_x": found.place[:1],
        "place_y": found.place[1:],
        "share": np.ones(1),
    }
    tables |= {"surface": surface.data} if len(surface.data) else {}
    return Pieces(
        1,
        3,
        tables,
        traced(step),
        _parameters(law),
        traced(steady),
        lambda: traced(slopes),
        moves=True,
    )


_KINDS = {DistributedModel: _distributed, ReducedModelPublished: _published}
