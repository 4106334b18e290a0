"""A program with types, as its author's strict pyright sees it: never run, read by test_types_of_pages."""

from typing import assert_type

import numpy as np

import planarfriction as pf
from planarfriction.derivatives import scene_gradient
from planarfriction.identify import Log, identify_lugre
from planarfriction.planning import holding_load

patch = pf.ContactPatch.disc(radius=0.01, cells=11)
assert_type(patch.contact_radius(), float)
assert_type(patch.second_moment(2.0), float)
assert_type(patch.area(np.array([1.0, 2.0])), np.ndarray)
assert_type(holding_load(np.array([0.0, -1.0, 0.0]), patch, 0.5), float)

model = pf.ReducedModel(patch, pf.LuGre(mu_c=0.5))
state, wrench = model.step(
    model.rest(), [0.01, 0.0, 1.0], normal_force=np.float64(2.0), dt=1e-3
)
run = pf.rollout(model, state, np.tile(wrench, (100, 1)), 1.0, 1e-3)
assert_type(run.wrenches, np.ndarray)

body = pf.Body(mass=0.2, inertia=1e-4, velocity=[0.1, 0.0, 0.0])
contacts = [
    pf.Contact(model, pf.Signal([0.0, 1.0], [5.0, 2.0])),
    pf.Contact(model, 5.0, mounted_on="body"),
]
solution = pf.simulate(pf.Scene(body, contacts, t_end=1.0), save_every=0.01)
print(
    solution.status.upper(),
    solution.statistics.steps + 1,
    float(solution.data.x.values[-1]),
)


def make(mu: float, grip: float) -> pf.Scene:
    return pf.scenes.in_hand(
        pf.ReducedModel(patch, pf.LuGre(mu_c=mu)), normal_force=grip
    )


def measure(run: pf.Solution) -> dict[str, float]:
    return {"y": float(run.histories["y"].values[-1])}


def cotangent(time: np.ndarray, motion: np.ndarray) -> np.ndarray:
    return np.zeros_like(motion) + time[:, None]


data = pf.sweep(make, {"mu": [0.5, 0.6], "grip": [3.0, 4.0]}, measure=measure)
print(
    data.y.sel(mu=0.5).values,
    scene_gradient(make(0.5, 3.0), cotangent, ["mu"]).gradient[0],
)

log = Log(
    time=np.arange(9.0), twist=np.ones((9, 3)), wrench=np.ones((9, 3)), normal_force=2.0
)
print(identify_lugre(log, patch).law.mu_c)
