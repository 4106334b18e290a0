# pyright: reportAttributeAccessIssue=false
# (MuJoCo describes few of its names to type checkers.)
"""Choice of contacts with patch friction, and preparation of a model for it."""

from __future__ import annotations

import difflib
import hashlib
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from planarfriction._engine.compiler.memory import Layout
from planarfriction._engine.coupled import placing
from planarfriction._support import validation
from planarfriction._support.equality import Checked
from planarfriction.adapters.mujoco.loops.models import DIGEST, LONGEST
from planarfriction.adapters.mujoco.loops.records import Memory, memory_layout
from planarfriction.environments import defaults
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import PARAMETERS
from planarfriction.models import FrictionModel

RECORD = "planarfriction"
"""Name of the custom numeric of a prepared model."""

CENTRES = ("auto", "site", "contact")

PRESSURES = ("auto", "follows", "fixed")

_ROUND = {
    int(getattr(mujoco.mjtGeom, f"mjGEOM_{name}"))
    for name in ("SPHERE", "CAPSULE", "ELLIPSOID")
}
"""Geoms that touch in points, not faces."""

_IMPLICIT = {
    int(getattr(mujoco.mjtIntegrator, f"mjINT_{name}"))
    for name in ("IMPLICIT", "IMPLICITFAST")
}

_CYLINDER = int(mujoco.mjtGeom.mjGEOM_CYLINDER)

_PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)
"""Geoms whose faces touch what is not round in several points. Elsewhere MuJoCo finds
one point, which says nothing of the pressure."""

_BOX = int(mujoco.mjtGeom.mjGEOM_BOX)
"""Geoms whose faces touch each other in several points."""


@dataclass(frozen=True)
class PatchContact(Checked):
    """A contact patch between two geoms, attached to the body of a site.

    The x axis of the patch is that of the site, projected on the contact plane; where it lies along the normal at the
    first contact, the y axis of the site takes its place. On a body that rolls it does not reverse as the site's does:
    within 30 degrees of the normal it goes along with the body, and then is on the same side as before. Bristles are
    carried into the axes of each step. The normal points into the site's body. The twist is that of the surface of this
    body relative to the other one's, and the wrench acts on this body.

    Raises InvalidValueError unless `geoms` are two names, `centre` is an option and `model` a friction model.
    """

    model: FrictionModel
    site: str
    """Name of a site on the body that owns the patch."""
    geoms: tuple[str, str]
    """Names of the two geoms in contact; one is on the site's body."""
    centre: str = "auto"
    """Origin of the patch in the plane of the contact: below the "site" along the normal, or the centre of the forces
    of "contact"; "auto" follows the contact of a sphere, a capsule, an ellipsoid, and of a cylinder's curved side."""
    pressure: str = "auto"
    """Pressure that "follows" the moments of the contact forces (see `ContactPatch.weights`), or is "fixed" to the
    patch; "auto" follows between two boxes, and between a plane and what is not a sphere, a capsule or an ellipsoid."""

    def __post_init__(self) -> None:
        validation.instance("model", self.model, FrictionModel, "a friction model")
        validation.text("site", self.site)
        if not (isinstance(self.geoms, Sequence) and len(self.geoms) == 2):
            raise InvalidValueError("geoms", "be the names of two geoms", self.geoms)
        self._set(geoms=tuple(validation.text("geoms", name) for name in self.geoms))
        validation.choice("centre", self.centre, CENTRES)
        validation.choice("pressure", self.pressure, PRESSURES)


def memory(patches: Sequence[PatchContact], nv: int, nuserdata: int) -> Any:
    """Return the places of what patches remember in the user data, at their end; raise where there is no room."""
    layout = layout_of(patches, nv)
    if nuserdata < layout.size:
        raise InvalidValueError(
            "nuserdata", f"be at least {layout.size} (prepare adds them)", nuserdata
        )
    return Memory(*(nuserdata - layout.size + place for place in layout.offsets))


def layout_of(patches: Sequence[PatchContact], nv: int) -> Layout:
    """Return the layout of the numbers that patches remember."""
    return memory_layout(
        sum(math.prod(patch.model.state_shape) for patch in patches), len(patches), nv
    )


def prepare(spec: Any, patches: Sequence[PatchContact]) -> Any:
    """Prepare an `MjSpec`, or a model file, for the patches; return the spec.

    Each patch gets a contact pair without friction; together they get room in the user data. An existing pair keeps its
    settings except for friction; a new one takes those that MuJoCo gives contacts of its geoms, adhesion, margin and
    gap among them. A second call replaces the room that the first one took. A custom numeric "planarfriction" holds the
    room taken, a digest of the patches, by which copies of the model are told from other models, and the parameters of
    the patches, which copies may change.

    Raises `InvalidValueError` for what is neither a spec nor the path of a file, for a geom or a site that does not
    exist, and for the same pair twice.
    """
    if isinstance(spec, str | Path) and Path(spec).is_file():
        spec = mujoco.MjSpec.from_file(str(spec))
    if not isinstance(spec, mujoco.MjSpec):
        rule = "be an MjSpec or the path of a model file (MjSpec.from_string takes XML; compile the model afterwards)"
        raise InvalidValueError(
            "spec", rule, spec if isinstance(spec, str | Path) else type(spec).__name__
        )
    check_once(patches)
    for patch in patches:
        _choose("site", patch.site, [each.name for each in spec.sites])
        for name in patch.geoms:
            _choose(
                "geoms",
                name,
                [each.name for each in spec.geoms],
                [each.name for each in spec.flexes],
            )
    compiled = spec.copy().compile()
    for patch in patches:
        pair = next(
            (
                each
                for each in spec.pairs
                if {each.geomname1, each.geomname2} == set(patch.geoms)
            ),
            None,
        )
        if pair is None:
            pair = spec.add_pair(geomname1=patch.geoms[0], geomname2=patch.geoms[1])
            for name, value in _between(
                compiled, [compiled.geom(name).id for name in patch.geoms]
            ).items():
                setattr(pair, name, value)
        pair.condim = 1
    room = layout_of(patches, compiled.nv).size
    record = next((each for each in spec.numerics if each.name == RECORD), None)
    taken = 0 if record is None else int(record.data[0])
    record = spec.add_numeric(name=RECORD) if record is None else record
    numbers = [number for patch in patches for number in defaults(patch.model.law)]
    record.data = [room, *_digest(patches), *numbers]
    record.size = len(record.data)
    spec.nuserdata = max(spec.nuserdata, 0) - taken + room
    return spec


_MIXED = "friction", "solref", "solimp", "solmix", "priority", "adhesion"
"""Fields of geoms from which those of their contacts follow; margins and gaps are told apart below."""


def _between(m: Any, geoms: Sequence[int]) -> dict[str, Any]:
    """Return the settings of a pair that MuJoCo itself gives contacts of two geoms, by its own rules: of two spheres.

    The rule for gaps is that for margins, which a contact tells.
    """

    def contact(margin: str) -> Any:
        spec = mujoco.MjSpec()
        for geom in geoms:
            body = spec.worldbody.add_body()
            body.add_freejoint()
            sphere = body.add_geom(
                size=[1.0, 0.0, 0.0], margin=getattr(m, f"geom_{margin}")[geom]
            )
            for name in _MIXED:
                if hasattr(m, f"geom_{name}"):
                    setattr(sphere, name, getattr(m, f"geom_{name}")[geom])
        d = mujoco.MjData(spec.compile())
        mujoco.mj_forward(d.model, d)
        return d.contact

    found = contact("margin")
    gap = contact("gap").includemargin[0]
    same = {
        name: getattr(found, name)[0]
        for name in dir(mujoco.MjsPair)
        if hasattr(found, name) and name[0] != "_"
    }
    return {**same, "margin": found.includemargin[0], "gap": gap}


def place_of_parameters(m: Any) -> int:
    """Return the place of the parameters of the patches in the numerics of a prepared model, or raise."""
    return (
        int(m.numeric_adr[_named(m, "numeric", RECORD, mujoco.mjtObj.mjOBJ_NUMERIC)])
        + DIGEST
    )


def parameters_in(m: Any, place: int, k: int) -> dict[str, np.ndarray]:
    """Return views `[k]` of the parameters of k patches in a model."""
    rows = m.numeric_data[place : place + k * len(PARAMETERS)].reshape(
        k, len(PARAMETERS)
    )
    return dict(zip(PARAMETERS, rows.T, strict=True))


def _digest(patches: Sequence[PatchContact]) -> list[int]:
    """Return numbers that tell patches from others, of five digits: XML keeps six."""
    found = hashlib.sha256()
    for each in patches:
        cells = each.model.patch
        found.update(repr((each, each.model.law)).encode())
        found.update(
            b"".join(
                numbers.tobytes()
                for numbers in (cells.positions, cells.radii, cells.areas)
            )
        )
        if not cells.depends_on_load:
            found.update(cells.weights().tobytes())
    return np.frombuffer(found.digest(), ">u2", 4).tolist()


def check_once(patches: Sequence[PatchContact]) -> None:
    """Raise for what is no list of patches, and for the same pair twice."""
    if not (isinstance(patches, Sequence) and patches):
        raise InvalidValueError(
            "patches", "be a list of PatchContact, not empty", patches
        )
    for patch in patches:
        validation.instance("patches", patch, PatchContact, "patches")
    pairs = [frozenset(patch.geoms) for patch in patches]
    for pair in pairs:
        if pairs.count(pair) > 1:
            raise InvalidValueError(
                "patches", "have each pair of geoms once", ", ".join(sorted(pair))
            )


def check_options(
    m: Any, *integrators: str, cone: str = "", sleeps: bool = False
) -> None:
    """Refuse options of a model that do not fit; `cone` is the reason why contacts have to have pyramidal ones."""
    options = m.opt
    integrator = mujoco.mjtIntegrator(options.integrator).name.removeprefix("mjINT_")
    if integrator.lower() not in map(str.lower, integrators):
        raise InvalidValueError(
            "integrator", f"be {', '.join(integrators)}", integrator
        )
    if cone and options.cone != mujoco.mjtCone.mjCONE_PYRAMIDAL:
        name = mujoco.mjtCone(options.cone).name.removeprefix("mjCONE_").lower()
        raise InvalidValueError("cone", f"be pyramidal{cone}", name)
    if options.noslip_iterations > 0:
        raise InvalidValueError(
            "noslip_iterations",
            "be 0: they would change the solution",
            options.noslip_iterations,
        )
    if not sleeps and options.enableflags & int(
        getattr(mujoco.mjtEnableBit, "mjENBL_SLEEP", 0)
    ):
        raise InvalidValueError(
            "sleep", "be disabled: sleeping bodies do not react to wrenches", "enabled"
        )


class Placed:
    """A patch found in a compiled model.

    `unprepared`: geoms without a pair will do, if their own contacts have no friction (condim 1); `pair` is -1 then.
    """

    def __init__(
        self, m: Any, patch: PatchContact, *, unprepared: bool = False
    ) -> None:
        self.patch = patch
        self.site = _named(m, "site", patch.site, mujoco.mjtObj.mjOBJ_SITE)
        self.geoms = np.array(
            [_named(m, "geoms", name, mujoco.mjtObj.mjOBJ_GEOM) for name in patch.geoms]
        )
        bodies = m.geom_bodyid[self.geoms]
        owner = m.site_bodyid[self.site]
        if bodies[0] == bodies[1]:
            raise InvalidValueError(
                "geoms", "be on two bodies", " and ".join(patch.geoms)
            )
        if owner not in bodies:
            raise InvalidValueError(
                "site", f"be on the body of one of the geoms {patch.geoms}", patch.site
            )
        own = int(bodies[1] == owner)
        self.own = int(self.geoms[own])
        self.other = int(self.geoms[1 - own])
        self.owner = int(owner)
        self.support = int(bodies[1 - own])
        kinds = set(m.geom_type[self.geoms].tolist())
        faces = kinds == {_BOX} or (_PLANE in kinds and not _ROUND.intersection(kinds))
        self.follows = patch.pressure == "follows" or (
            patch.pressure == "auto" and faces
        )
        """True if the pressure follows the contact forces."""
        reach = [
            math.inf if m.geom_type[geom] == _PLANE else m.geom_rbound[geom]
            for geom in (self.own, self.other)
        ]
        self.carrier = self.own if reach[0] <= reach[1] else self.other
        """The smaller geom, along with which the patch goes over the other."""
        self.centre = CENTRES.index(patch.centre)
        """Origin of the patch, one of those of `placing`."""
        self.curved = placing.ROUND if _ROUND.intersection(kinds) else 0
        """Bits of its curved sides, as those of `placing`."""
        for geom, bit in ((self.own, placing.OWN), (self.other, placing.OTHER)):
            self.curved |= bit if int(m.geom_type[geom]) == _CYLINDER else 0
        self.on_box = int(m.geom_type[self.other]) == _BOX
        for pair in range(m.npair):
            if {int(m.pair_geom1[pair]), int(m.pair_geom2[pair])} == set(
                self.geoms.tolist()
            ):
                self.pair = pair
                self.check(m)
                return
        self.pair = -1
        if not (unprepared and (m.geom_condim[self.geoms] == 1).all()):
            raise InvalidValueError(
                "pair", "be in the model (prepare adds it)", " and ".join(patch.geoms)
            )

    def check(self, m: Any) -> None:
        """Refuse a pair with friction of its own, and time steps at which MuJoCo's own normal contact is lost.

        These are above half of its time constant, unless MuJoCo makes the contact softer (`refsafe`) and the integrator
        is implicit.
        """
        if m.pair_dim[self.pair] != 1:
            rule = f"have condim 1 between {' and '.join(self.patch.geoms)} (prepare does that)"
            raise InvalidValueError("pair", rule, int(m.pair_dim[self.pair]))
        constant = float(m.pair_solref[self.pair, 0])
        dt = m.opt.timestep
        safe = (
            m.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_REFSAFE) == 0
            and m.opt.integrator in _IMPLICIT
        )
        if not (safe and dt <= LONGEST) and 0.0 < 0.5 * constant < dt:
            rule = f"be at most half of solref[0] = {constant:g} s of the pair {' and '.join(self.patch.geoms)}"
            rule += f", or {LONGEST:g} s with refsafe and implicit or implicitfast"
            raise InvalidValueError("timestep", rule, dt)

    def contacts(self, d: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return its contacts that are in the solver, and the sign of their normals: 1 into the owner."""
        pairs = d.contact.geom
        forward = (pairs[:, 0] == self.other) & (pairs[:, 1] == self.own)
        backward = (pairs[:, 0] == self.own) & (pairs[:, 1] == self.other)
        chosen = np.flatnonzero((forward | backward) & (d.contact.efc_address >= 0))
        return chosen, np.where(forward[chosen], 1.0, -1.0)

    def frame(
        self,
        d: Any,
        chosen: np.ndarray,
        sign: np.ndarray,
        centre: np.ndarray,
        axis: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return origin [3] and axes [3, 3], as rows, of its frame in the world.

        `centre` [3] and x `axis` [3] are in the frame of the site.
        """
        normal = sign @ d.contact.frame[chosen, :3]
        normal /= np.linalg.norm(normal)
        turned = d.site_xmat[self.site].reshape(3, 3)
        x = turned @ axis
        x -= (x @ normal) * normal
        x /= np.linalg.norm(x)
        return d.site_xpos[self.site] + turned @ centre, np.array(
            [x, np.cross(normal, x), normal]
        )


def misplaced_line(placed: Sequence[Placed], found: int) -> str | None:
    """Return a line about the patch and fault that a step has noted in its memory, None for 0."""
    if found == 0:
        return None
    patch = placed[found // placing.FAULTS].patch
    return placing.fault_line("site", patch.site, patch.geoms, found % placing.FAULTS)


def surface_velocities(m: Any, placed: Sequence[Placed]) -> np.ndarray:
    """Return the velocities of the surfaces of both geoms of patches in their frames (`surfacevel`), `[k, 2, 6]`."""
    surface = getattr(m, "geom_surfacevel", np.zeros((m.ngeom, 6)))
    return surface[[(each.own, each.other) for each in placed]]


def _named(m: Any, what: str, name: str, kind: Any) -> int:
    found = mujoco.mj_name2id(m, kind, name)
    if found < 0:
        count = getattr(m, f"n{kind.name.removeprefix('mjOBJ_').lower()}")
        flexes = [
            mujoco.mj_id2name(m, mujoco.mjtObj.mjOBJ_FLEX, i) for i in range(m.nflex)
        ]
        _choose(
            what, name, [mujoco.mj_id2name(m, kind, i) for i in range(count)], flexes
        )
    return found


def _choose(
    what: str, name: str, names: Iterable[str | None], flexes: Iterable[str | None] = ()
) -> None:
    """Raise unless a name is among these, and tell some of them, like ones first."""
    known = sorted(filter(None, names))
    if what == "geoms" and name not in known and name in flexes:
        raise InvalidValueError(what, "be rigid: flexes cannot have patches", name)
    if name not in known:
        near = difflib.get_close_matches(name, known, 3) or known[:5]
        told = f" (did you mean {' or '.join(near)}?)" if near else ""
        raise InvalidValueError(what, "be in the model", name + told)
