"""The path of a call through the library: the figure in docs/maintaining.md shows the rooms that calls walk through."""

import functools
import importlib
import inspect
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import derivatives, identify
from planarfriction.export import library

HOME = Path(pf.__file__).parent
PAGE = Path(__file__).parents[2] / "docs" / "maintaining.md"
ROOMS = {
    *(
        "_engine",
        "adapters",
        "cli",
        "coupling",
        "derivatives",
        "export",
        "identify",
        "jax",
    ),
    *(
        "models",
        "online",
        "planning",
        "plots",
        "records",
        "scenes",
        "solvers",
        "sweeps",
        "tactile",
        "tensors",
        "torch",
        "warp",
    ),
}
"""Layers that a call goes through; what describes (patches, surfaces, laws) may be asked from everywhere."""

READERS = {"trace.py", "twins.py", "rewriting.py", "elements.py"}
"""Files that run the source of kernels over symbols or arrays."""

LAW = pf.LuGre(
    mu_c=0.5, mu_s=0.6, v_s=2e-3, sigma_0=2e4, sigma_1=30.0, elasto_plastic=0.9
)
MODEL = pf.DistributedModel(pf.ContactPatch.disc(0.01, 7), LAW)
TWISTS = 1e-3 * np.sin(np.arange(60.0).reshape(20, 3))


def step(folder):
    MODEL.step(MODEL.rest(), TWISTS[1], 2.0, 1e-3)


def scene(folder):
    pf.simulate(
        pf.Scene(
            pf.Body(0.2, 1e-4, velocity=(0.1, 0.0, 0.0)), pf.Contact(MODEL, 2.0), 0.02
        )
    )


def gradient(folder):
    # What is prepared once is not prepared by others before.
    model = MODEL.with_law(MODEL.law)
    derivatives.rollout_vjp(model, None, TWISTS, 2.0, 1e-3, np.ones_like(TWISTS))


def log(folder):
    time = 1e-3 * np.arange(60)
    twists = (
        0.02
        * np.sin(np.stack([30.0 * time, 50.0 * time, 3.0 * time], -1))
        * [1.0, 1.0, 100.0]
    )
    _, wrenches = derivatives.rollout(MODEL, None, twists[1:], 2.0, 1e-3)
    measured = identify.Log(
        time, twists, np.concatenate([np.zeros((1, 3)), wrenches]), 2.0
    )
    options = identify.FitOptions(elasto_plastic=0.9, starts=1, nuisance=())
    identify.identify_lugre(
        measured,
        MODEL.patch,
        parameters=["mu_c"],
        model="reduced-published",
        start=LAW,
        options=options,
    )


@functools.cache
def torch_model():
    pytest.importorskip("torch")
    return importlib.import_module("planarfriction.torch").DistributedModel(
        MODEL.patch, LAW
    )


def torch_rollout(folder):
    model = torch_model()
    torch = sys.modules["torch"]
    ours = sys.modules["planarfriction.torch"]
    twists = torch.tensor(TWISTS, requires_grad=True)
    _, wrenches = ours.rollout(model, model.rest(), twists, torch.tensor(2.0), 1e-3)
    wrenches.sum().backward()


def export(folder):
    library.export_c(MODEL, folder)


CALLS = {
    "step": step, "scene": scene, "gradient": gradient, "log": log, "torch rollout": torch_rollout, "C export": export
}  # fmt: skip


def walked(call, folder):
    """Return the rooms on the stack at every call of a function of the library, the outermost first."""
    found = set()
    known = set()

    def seen(frame, event, _):
        pair = frame.f_code, frame.f_back and frame.f_back.f_code
        if event == "call" and pair not in known:
            known.add(pair)
            found.add(tuple(_rooms(frame)))

    sys.setprofile(seen)
    try:
        call(folder)
    finally:
        sys.setprofile(None)
    return found


def _rooms(frame):
    """Return the rooms from the outermost frame inwards.

    A generator that is asked for more is where it was begun; mathematics over arrays or symbols is no room, nor is the
    source of a kernel that is read symbol by symbol.
    """
    found = []
    while frame is not None:
        file = Path(frame.f_code.co_filename)
        inside = (
            file.relative_to(HOME) if file.is_relative_to(HOME) else Path("elsewhere")
        )
        room = inside.parts[0].removesuffix(".py")
        # The latter is no room of a call.
        if inside.parts[:2] in (
            ("_engine", "records"),
            ("_engine", "compiler"),
        ):
            room = inside.parts[1]
        if inside.name in READERS:
            found.clear()
        elif room in ROOMS and inside.name != "namespace.py" and found[-1:] != [room]:
            found.append(room)
        frame = None if frame.f_code.co_flags & inspect.CO_GENERATOR else frame.f_back
    return found[::-1]


def ways():
    """Return the rooms of each call from the figure."""
    figure = re.search(
        r"```text\n(step .*?)```", PAGE.read_text(encoding="utf-8"), re.S
    )
    assert figure is not None
    lines = (
        re.split(r"\s{2,}", line.strip(), maxsplit=1)
        for line in figure[1].strip().splitlines()
    )
    return {name: rooms.split(" > ") for name, rooms in lines}


@pytest.mark.parametrize("name", CALLS)
def test_a_call_walks_through_the_rooms_of_its_figure(name, tmp_path):
    way = ways()[name]
    assert len(way) <= 5
    CALLS[name](tmp_path)  # imports and compiles
    paths = walked(CALLS[name], tmp_path)
    assert {room for path in paths for room in path} == set(way)
    for path in paths:
        assert len(set(path)) == len(path), f"{' > '.join(path)} enters a room twice"
        places = [way.index(room) for room in path]
        assert places == sorted(places), f"{' > '.join(path)} is against the figure"


def test_the_figure_has_every_call():
    assert list(ways()) == list(CALLS)
