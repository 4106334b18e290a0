"""Matrices of a step inside MuJoCo, from compiled loops, against the same sums in NumPy over MuJoCo's arrays."""

from __future__ import annotations

import copy
from typing import NamedTuple

import numba
import numpy as np
import pytest

import planarfriction as pf

mujoco = pytest.importorskip("mujoco")

from planarfriction._engine.compiler.memory import doubles, place_of  # noqa: E402
from planarfriction.adapters.mujoco import Friction, PatchContact, prepare  # noqa: E402
from planarfriction.adapters.mujoco.loops import responses  # noqa: E402
from planarfriction.adapters.mujoco.loops.records import read  # noqa: E402

pytestmark = pytest.mark.mujoco

PAD = pf.ReducedModel(
    pf.ContactPatch.disc(radius=0.01, cells=9), pf.LuGre(mu_c=0.5, mu_s=0.5)
)


class Matrices(NamedTuple):
    """Fields of `Scratch` that the compiled function uses."""

    inertia: object
    stiff: object
    misses: object


@numba.njit
def matrices(host, m, d, nefc, places, x, products):
    """Write M, H and misses to their places, and the Jacobian of the constraints times x."""
    own = read(host)
    s = Matrices(doubles(places[0]), doubles(places[1]), doubles(places[2]))
    sparse = responses.is_sparse(own, m)
    for r in range(nefc):
        products[r] = responses.row_times(own, d, sparse, r, x)
    responses._stiff(own, m, d, s, sparse, nefc)
    return sparse


def rows_of(m, d):
    """Return the Jacobian of the constraints [nefc, nv] from MuJoCo's own multiplication."""
    columns = np.zeros((m.nv, d.nefc))
    for column, unit in zip(columns, np.eye(m.nv), strict=True):
        mujoco.mj_mulJacVec(m, d, column, unit)
    return columns.T


@pytest.mark.parametrize("jacobian", ["dense", "sparse"])
@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
def test_stiffness_is_that_of_active_constraints(jacobian, cone):
    """`H = M + J' D J` over quadratic rows, and `J' C J` over the cones of a box that slides on the floor."""
    text = f"""<mujoco><option timestep="0.002" cone="{cone}" jacobian="{jacobian}" tolerance="1e-15"/>
    <default><geom friction="0.3 0.01 0.001" condim="4"/></default><worldbody>
    <geom type="plane" size="1 1 0.1" contype="2" conaffinity="2"/>
    <body name="lower" pos="0 0 0.0199"><freejoint/>
    <geom name="lower" type="box" size="0.05 0.04 0.02" mass="0.3" contype="3" conaffinity="2"/></body>
    <body name="upper" pos="0.005 0.002 0.0598"><joint type="slide" axis="0 0 1"/><joint axis="0 1 1" damping="0.1"
    frictionloss="0.02"/><geom name="upper" type="box" size="0.03 0.02 0.02" mass="0.5" contype="0" conaffinity="1"/>
    <site name="upper" pos="0 0 -0.02"/></body></worldbody></mujoco>"""
    spec = mujoco.MjSpec.from_string(text)
    patches = [PatchContact(PAD, site="upper", geoms=("lower", "upper"))]
    prepare(spec, patches)
    m = spec.compile()
    d = mujoco.MjData(m)
    friction = Friction(m, patches)
    d.qvel[:] = 0.3, 0.1, -0.01, 0.0, 0.0, 0.8, -0.02, 0.2
    mujoco.mj_forward(m, d)
    jac = rows_of(m, d)
    inertia = np.zeros((m.nv, m.nv))
    for column, unit in zip(inertia, np.eye(m.nv), strict=True):
        mujoco.mj_mulM(m, d, column, unit)
    misses = jac @ d.qacc - d.efc_aref
    other = copy.copy(d)
    n = d.nefc
    mujoco.mj_constraintUpdate(m, other, misses, None, 1)
    row = friction._host_row()
    x = np.linspace(-1.0, 2.0, m.nv)
    friction.state(d)  # it counts as used: no step is taken here
    found = np.zeros((m.nv, m.nv)), np.zeros((m.nv, m.nv)), np.zeros(n)
    products = np.zeros(n)
    places = np.array([place_of(each) for each in found])
    assert matrices(place_of(row), m._address, d._address, n, places, x, products) == (
        jacobian == "sparse"
    )
    np.testing.assert_allclose(products, jac @ x, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(found[0], inertia, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(found[2], misses, rtol=1e-9, atol=1e-9)

    states = other.efc_state
    quadratic = states == mujoco.mjtConstraintState.mjCNSTRSTATE_QUADRATIC
    assert 2 <= quadratic.sum() < n
    wanted = inertia + (jac[quadratic].T * d.efc_D[quadratic]) @ jac[quadratic]
    cones = 0
    for contact in other.contact:
        first = contact.efc_address
        dim = contact.dim
        if first >= 0 and states[first] == mujoco.mjtConstraintState.mjCNSTRSTATE_CONE:
            own = jac[first : first + dim]
            wanted += (
                own.T
                @ np.reshape(contact.H, (-1,))[: dim * dim].reshape(dim, dim)
                @ own
            )
            cones += 1
    assert cones == (4 if cone == "elliptic" else 0)
    np.testing.assert_allclose(
        found[1], wanted, rtol=1e-9, atol=1e-9 * abs(wanted).max()
    )


class Metric(NamedTuple):
    """Fields of `Scratch` that the compiled function uses."""

    inertia: object
    stiff: object
    block: object


@numba.njit
def metric(host, m, d, places):
    """Write the metric of the integrator over the inertia, and return True if it is another."""
    own = read(host)
    s = Metric(doubles(places[0]), doubles(places[1]), doubles(places[2]))
    responses._metric(own, m, d, s)
    return responses._has_metric(own, m)


@pytest.mark.parametrize(
    ("integrator", "damping", "forces"),
    [
        ("Euler", 0.3, ("qfrc_damper",)),
        ("Euler", 0.0, ()),
        ("implicit", 0.3, ("qfrc_smooth",)),
        ("implicitfast", 0.3, ("qfrc_passive", "qfrc_actuator")),
    ],
)
def test_metric_holds_the_forces_that_the_integrator_takes_as_implicit(
    integrator, damping, forces
):
    """`Mh = M - dt dF/dv`, with differences of the forces F over velocities; an arm that swings and a geared slide."""
    text = f"""<mujoco><option timestep="0.002" integrator="{integrator}"/>
    <default><geom contype="0" conaffinity="0"/></default><worldbody><geom name="floor" type="plane" size="1 1 0.1"/>
    <body><joint name="swing" axis="0 1 0" damping="{damping}"/>
    <geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.02"/>
    <body pos="0.4 0 0"><joint axis="0 1 0" damping="{2 * damping}"/><joint name="slide" type="slide" axis="1 0 0"/>
    <geom name="hand" type="box" pos="0.2 0 0" size="0.05 0.03 0.02"/><site name="hand"/></body></body></worldbody>
    <tendon><fixed name="both"><joint joint="swing" coef="0.7"/><joint joint="slide" coef="-1.5"/></fixed></tendon>
    <actuator><velocity tendon="both" kv="4"/></actuator></mujoco>"""
    spec = mujoco.MjSpec.from_string(text)
    patches = [PatchContact(PAD, site="hand", geoms=("hand", "floor"))]
    prepare(spec, patches)
    m = spec.compile()
    d = mujoco.MjData(m)
    friction = Friction(m, patches)
    row = friction._host_row()
    friction.state(d)  # it counts as used: no step is taken here
    start = np.array([1.5, -2.0, 0.4])
    d.qpos[:] = [0.3, 0.9, 0.05]
    d.qvel[:] = start
    mujoco.mj_forward(m, d)
    inertia = np.zeros((m.nv, m.nv))
    for column, unit in zip(inertia, np.eye(m.nv), strict=True):
        mujoco.mj_mulM(m, d, column, unit)
    found = inertia.copy(), np.zeros((m.nv, m.nv)), np.zeros(36)
    other = metric(
        place_of(row),
        m._address,
        d._address,
        np.array([place_of(each) for each in found]),
    )
    assert other == bool(forces)

    def force(velocity):
        d.qvel[:] = velocity
        mujoco.mj_forward(m, d)
        return sum((getattr(d, name) for name in forces), np.zeros(m.nv))

    step = 1e-4  # forces are of degree two in the velocities: central differences are exact but for rounding
    slopes = [
        (force(start + step * unit) - force(start - step * unit)) / (2.0 * step)
        for unit in np.eye(m.nv)
    ]
    wanted = inertia - m.opt.timestep * np.transpose(slopes)
    np.testing.assert_allclose(
        found[1], wanted, rtol=1e-7, atol=1e-8 * abs(wanted).max()
    )
