"""Random legal scenes: they run, and come back from their files as they were."""

from __future__ import annotations

import copy
import pickle
import random

import numpy as np
import some
from attack import attack, folder
from judge import Broken, judge
from test_fuzz_solution_files import same
from working import use

import planarfriction as pf


@attack("scenes", 60)
def test_scenes_run_and_come_back(draw: random.Random) -> None:
    scene = judge("scenes: built", lambda: some.scene(draw), compiles=True)
    if scene is None:
        return

    def run() -> pf.Solution:
        try:
            return pf.simulate(scene, bristles="all")
        except pf.errors.SolverError as gave_up:
            use(gave_up.solution)
            raise

    solution = judge("scenes: simulated", run, compiles=True)
    if solution is None:
        return
    use(solution)
    with folder() as here:
        loaded = judge(
            "scenes: saved and loaded",
            lambda: pf.Solution.load(solution.save(here / "solution.nc")),
        )
        name = draw.choice(["scene.toml", "scene.json"])
        scene.to_file(here / name)
        read = judge(
            "scenes: written and read", lambda: pf.Scene.from_file(here / name)
        )
    if loaded is None or not same(loaded, solution):
        raise Broken("the solution is not what was saved")
    for again in (read, pickle.loads(pickle.dumps(scene)), copy.deepcopy(scene)):
        if again is None or again != scene or again.digest() != scene.digest():
            raise Broken("the scene is not what was written")
    again = pf.simulate(read, bristles="all")
    if not same(again, solution):
        raise Broken(
            f"the scene that was read runs otherwise: {told(scene, solution, again)}"
        )


def told(scene: pf.Scene, first: pf.Solution, second: pf.Solution) -> str:
    """What differs and by how much, and which of the two a third run is like."""
    third = pf.simulate(scene, bristles="all")
    like = (
        " and ".join(
            word
            for word, each in (("first", first), ("second", second))
            if same(third, each)
        )
        or "neither"
    )
    if len(first.data.time) != len(second.data.time):
        return f"{len(first.data.time)} samples, then {len(second.data.time)}; a third run is like {like}"
    pairs = (
        (name, first.data[name].values, second.data[name].values)
        for name in sorted(first.data.variables)
    )
    apart = [
        f"{name} {np.abs(a - b).max():.1e}"
        for name, a, b in pairs
        if a.dtype.kind == "f" and (a != b).any()
    ]
    return f"{first.status}, {second.status}, {', '.join(apart)}; a third run is like {like}"
