"""Random scenes that slide, stick and are hit, with costs of their motions, for tests of derivatives."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

import planarfriction as pf

MODELS = ("reduced", "distributed", "ellipsoid", "fixed reduced")
KINDS = ("pushed", "stick-slip", "impacts", "held", "thrown")


class Example(NamedTuple):
    """A scene, the numbers by which it is differentiated, and a cost."""

    scene: pf.Scene
    numbers: dict[str, Any]
    """Arguments of `scene_gradient`."""
    told: str
    """Kinds of the motion, the model and the cost."""
    cost: str
    """`end`, `track`, `speed` or `wrench`."""
    seed: int

    def cotangents(
        self, motion: np.ndarray, wrenches: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return derivatives of the cost by the motion and by the wrenches, of random signs."""
        rng = np.random.default_rng(self.seed)
        of_motion = np.zeros_like(motion)
        of_wrenches = np.zeros_like(wrenches)
        size = np.maximum(np.abs(motion).max(axis=0), 1e-9)
        if self.cost == "end":
            of_motion[-1, 3:] = rng.normal(size=3) / size[3:]
        elif self.cost == "track":
            of_motion[:] = rng.normal(size=motion.shape) / size
        elif self.cost == "speed":
            of_motion[rng.integers(1, len(motion)), :3] = rng.normal(size=3) / size[:3]
        else:
            largest = np.maximum(np.abs(wrenches).max(axis=(0, 1)), 1e-9)
            of_wrenches[:] = rng.normal(size=wrenches.shape) / largest
        return of_motion, of_wrenches


def _spread(rng: np.random.Generator, low: float, high: float) -> float:
    return float(10.0 ** rng.uniform(np.log10(low), np.log10(high)))


def _model(
    rng: np.random.Generator, kind: str, size: float, load: float
) -> pf.models.FrictionModel:
    """Return a model of a patch; soft or stiff bristles, much or no damping, with or without a breakaway."""
    mu_c = rng.uniform(0.1, 1.0)
    law = pf.LuGre(
        mu_c=mu_c,
        mu_s=mu_c * rng.choice([1.0, rng.uniform(1.02, 1.6)]),
        v_s=_spread(rng, 1e-3, 2e-2),
        sigma_0=_spread(rng, 1e3, 1e6),
        sigma_1=float(rng.choice([0.0, _spread(rng, 1.0, 1e3)])),
        sigma_2=float(rng.choice([0.0, rng.uniform(0.0, 1.0)])),
        elasto_plastic=rng.choice([None, 0.9, rng.uniform(0.3, 0.95)]),
        reference_load=load if kind == "fixed reduced" else None,
    )
    sides = size * rng.uniform(0.5, 1.5), size * rng.uniform(0.5, 1.5)
    if kind == "distributed":
        return pf.DistributedModel(pf.ContactPatch.rectangle(*sides, cells=5), law)
    patch = pf.ContactPatch.rectangle(*sides, cells=11)
    if kind == "ellipsoid":
        return pf.ReducedModelPublished(
            patch, law, surface=pf.LimitSurfaceEllipsoid(patch)
        )
    return pf.ReducedModel(patch, law, cells=int(rng.integers(1, 25)))


def _wave(rng: np.random.Generator, times: np.ndarray, size: float) -> np.ndarray:
    """Return a sum of a trend and two sines [T] that reaches about `size`."""
    wave = rng.uniform(-1, 1) * times / times[-1]
    for _ in range(2):
        wave = wave + rng.uniform(0.2, 0.7) * np.sin(
            rng.uniform(2.0, 40.0) * times + rng.uniform(0, 6.3)
        )
    return size * wave


def _blows(rng: np.random.Generator, load: float, t_end: float) -> pf.Signal:
    """Return a load that is hit 2 to 30 times as hard for some milliseconds, or lost and found again."""
    times = [0.0]
    values = [load]
    for start in np.sort(rng.uniform(0.05, 0.9, size=int(rng.integers(1, 6)))) * t_end:
        rise = _spread(rng, 1e-4, 5e-3)
        if start > times[-1] + 1e-3:
            peak = load * rng.choice(
                [0.0, _spread(rng, 2.0, 30.0), _spread(rng, 2.0, 30.0)]
            )
            times += [start, start + rise, start + 2 * rise]
            values += [load, peak, load]
    return pf.Signal(times, values, str(rng.choice(["linear", "previous"])))


def example(seed: int) -> Example:
    """Return the random scene of a seed."""
    rng = np.random.default_rng(seed)
    kind = KINDS[seed % 5]
    model_kind = MODELS[seed // 5 % 4]
    cost = str(rng.choice(["end", "track", "speed", "wrench"]))
    mass = _spread(rng, 0.01, 10.0)
    size = _spread(rng, 5e-3, 5e-2)
    t_end = rng.uniform(0.1, 1.0)
    load: Any = 9.81 * mass
    model = _model(rng, model_kind, size, load)
    grip = model.law.mu_c * load
    times = np.linspace(0.0, t_end, int(rng.integers(5, 102)))
    push = np.stack(
        [_wave(rng, times, share * grip) for share in (1.2, 0.5, 0.3 * size)], axis=1
    )
    options: dict[str, Any] = {
        "force": pf.Signal(
            times, push, str(rng.choice(["linear", "linear", "previous"]))
        )
    }
    body: dict[str, Any] = {"gravity": (0.0, 0.0)}
    thrown = (rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-20, 20))
    if kind == "stick-slip":
        stiff = _spread(rng, 2.0, 200.0) * grip / size
        anchor = pf.Signal(
            [0.0, t_end],
            [(0.0, 0.0), (_spread(rng, 2e-3, 5e-2) * t_end, 0.0)],
            "linear",
        )
        options = {
            "springs": pf.Spring(
                stiff, float(rng.choice([0.0, 0.02 * np.sqrt(stiff * mass)])), anchor
            )
        }
    elif kind == "impacts":
        load = _blows(rng, load, t_end)
        body["velocity"] = tuple(_spread(rng, 1e-2, 1.0) * np.array(thrown))
    elif kind == "held":
        loads = 9.81 * mass / model.law.mu_c * (1.2 + _wave(rng, times, 0.5))
        load = pf.Signal(times, np.maximum(loads, 0.0), "linear")
        options = {}
        body["gravity"] = (0.0, -9.81)
    elif kind == "thrown":
        options = {}
        body["velocity"] = thrown
    count = int(rng.integers(1, 3))
    contacts = [
        pf.Contact(
            model,
            load,
            position=tuple(rng.uniform(-size, size, 2))
            if i or kind == "held"
            else (0.0, 0.0),
            mounted_on="world" if kind == "held" else "body",
            name=f"pad {i}",
        )
        for i in range(count)
    ]
    inertia = mass * size**2 * rng.uniform(0.3, 3.0)
    scene = pf.Scene(
        pf.Body(mass, inertia, **body),
        contacts,
        t_end,
        save_every=t_end / 40,
        **options,
    )
    names = [
        name for name in ("mu", "mass", "inertia", "load") if rng.random() < 0.6
    ] or ["mu"]
    numbers: dict[str, Any] = {
        "parameters": tuple(names),
        "initial": ((), ("vx",), ("y", "theta"))[rng.integers(3)],
    }
    if rng.random() < 0.5 and scene.force is not None:
        numbers["signals"] = {"force": scene.force.times}
    elif (
        rng.random() < 0.5
        and "load" not in names
        and contacts[0].normal_force.values.min() > 0.0
    ):
        numbers["signals"] = {"pad 0.normal_force": contacts[0].normal_force.times}
    return Example(scene, numbers, f"{kind}, {model_kind}, {cost}", cost, seed)
