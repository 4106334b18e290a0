"""A disc slides and spins to rest in Newton, with Newton's own friction and with that of a patch.

Needs Newton and MuJoCo Warp: pip install newton 'planarfriction[mujoco-warp]'.   python examples/newton_disc.py
"""

from __future__ import annotations

import logging
from contextlib import ExitStack
from typing import Any

import newton
import numpy as np
import warp as wp

import planarfriction as pf
from planarfriction.adapters.mujoco_warp import Friction, PatchContact

MU, RADIUS, HEIGHT, MASS, DT = 0.3, 0.1, 0.004, 0.2, 0.002
SPEED, SPIN = 1.0, 10.0
EXACT = 0.216581, 2.460359
"""Distance [m] and angle [rad] of a Coulomb disc that starts so."""


def scene(own: bool) -> tuple[Any, Any]:
    """Return the model and its solver, with Newton's own friction or with none."""
    builder = newton.ModelBuilder()
    newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
    material = newton.ModelBuilder.ShapeConfig(
        mu=MU, density=MASS / (np.pi * RADIUS**2 * HEIGHT)
    )
    material.mu_torsional = 2.0 / 3.0 * RADIUS
    options = (
        {"cfg": material}
        if own
        else {"cfg": material, "custom_attributes": {"mujoco:condim": 1}}
    )
    builder.add_shape_plane(
        body=-1,
        plane=(0.0, 0.0, 1.0, 0.0),
        width=0.0,
        length=0.0,
        label="floor",
        **options,
    )
    disc = builder.add_body(xform=((0.0, 0.0, 0.5 * HEIGHT), (0.0, 0.0, 0.0, 1.0)))
    builder.add_shape_cylinder(
        disc, radius=RADIUS, half_height=0.5 * HEIGHT, label="disc", **options
    )
    builder.add_site(
        disc, xform=((0.0, 0.0, -0.5 * HEIGHT), (0.0, 0.0, 0.0, 1.0)), label="under"
    )
    model = builder.finalize(device="cpu")
    return model, newton.solvers.SolverMuJoCo(
        model, cone="pyramidal", include_sites=True
    )


def patch_friction(solver: Any) -> Friction:
    """Return the friction of a disc of the size of the shape."""
    m = solver.mj_model
    law = pf.LuGre(mu_c=MU, sigma_0=1e5, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9)
    disc = pf.ReducedModel(pf.ContactPatch.disc(radius=RADIUS, cells=31), law)
    patch = PatchContact(
        disc, site=m.site(0).name, geoms=(m.geom(0).name, m.geom(1).name)
    )
    return Friction(m, [patch], model=solver.mjw_model, data=solver.mjw_data)


def slide(own: bool) -> tuple[float, float]:
    """Return how far the disc slides [m] and turns [rad]."""
    model, solver = scene(own)
    before, after, control, contacts = (
        model.state(),
        model.state(),
        model.control(),
        newton.Contacts(64, 0, device="cpu"),
    )
    distance, angle = (
        0.5 * DT * SPEED,
        0.5 * DT * SPIN,
    )  # what the stepper leaves out of the first step
    with ExitStack() as stack:
        if not own:
            stack.enter_context(patch_friction(solver).install())
        for i in range(700):
            if i == 100:  # it has settled
                before.joint_qd.assign([SPEED, 0.0, 0.0, 0.0, 0.0, SPIN])
                before.body_qd.assign([[SPEED, 0.0, 0.0, 0.0, 0.0, SPIN]])
            solver.step(before, after, control, contacts, DT)
            before, after = after, before
            if i >= 100:
                velocity = before.body_qd.numpy()[0]
                distance, angle = distance + DT * velocity[0], angle + DT * velocity[5]
    return distance, angle


if __name__ == "__main__":
    wp.config.log_level = logging.ERROR
    for name, own in (("Newton's own", True), ("patch", False)):
        errors = [
            100.0 * (found / exact - 1.0)
            for found, exact in zip(slide(own), EXACT, strict=True)
        ]
        print(
            f"{name:12}  distance {errors[0]:+6.2f} %, angle {errors[1]:+6.2f} % of a disc with Coulomb friction"
        )
