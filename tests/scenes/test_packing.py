"""Motions in windows: where a window ends leaves no trace, and what a run takes of memory does not grow with it."""

import tracemalloc

import numpy as np
import pytest

import planarfriction as pf
from planarfriction._engine.records import packed as limits
from planarfriction.scenes import packing
from planarfriction.scenes.packing import MOST_PIECES, SegmentBatches, Segments
from tests.support.refusals import refused

LAW = pf.LuGre(mu_s=1.2, elasto_plastic=pf.ElastoPlastic(0.9))
FINGER = pf.SoftFinger(c=6 * 0.02 / 9, n=1 / 3, k_per_newton=2.0, radius_max=0.01)
SOFT = pf.ContactPatch.rectangle(0.02, cells=9, pressure=FINGER)
MAPS = pf.ContactPatch.from_pressure(
    {1.0: [[0, 1, 2, 1]], 1.5: [[1, 2, 1, 0]], 3.0: [[1, 1, 1, 0]]}, cell_size=4e-3
)
FIXED = pf.ContactPatch.disc(0.01, cells=5)
MODELS = {
    "distributed": lambda: pf.DistributedModel(SOFT, LAW),
    "distributed, measured": lambda: pf.DistributedModel(MAPS, LAW),
    "reduced": lambda: pf.ReducedModel(SOFT, LAW, cells=12),
    "published": lambda: pf.ReducedModelPublished(
        SOFT, LAW, pf.LimitSurfaceTablePublished(SOFT, segments=4)
    ),
}


def ramp(*samples):
    times, values = zip(*samples, strict=True)
    return pf.Signal.sampled(times, values, hold="linear")


def free(model):
    """Loads that rise, hold, vanish, return and fall; a second contact of fixed shape; a force that bends."""
    load = ramp(
        (0.0, 0.8),
        (0.012, 2.2),
        (0.015, 2.2),
        (0.02, 0.0),
        (0.023, 0.0),
        (0.03, 1.7),
        (0.05, 1.2),
    )
    held = pf.Signal.sampled([0.0, 0.0105, 0.02], [1.0, 0.4, 1.1])
    force = pf.Signal.sampled(
        [0.0, 0.02, 0.04], [[0.0, 0, 0], [2.0, 1.0, 0.01], [0.0, 0, 0]], hold="linear"
    )
    contacts = [
        pf.Contact(model, load, name="soft", position=(0.01, 0.0), angle=0.3),
        pf.Contact(
            pf.DistributedModel(FIXED, LAW), held, name="hard", mounted_on="body"
        ),
    ]
    return pf.Scene(
        pf.Body(0.1, 1e-4, velocity=(0.0, 0.02, 1.0)),
        contacts,
        0.035,
        force=force,
        save_every=7e-4,
    )


def driven(model):
    twist = pf.Signal.sampled(
        [0.0, 0.01, 0.02],
        [[0.0, 0, 0], [0.02, 0, 3.0], [0.0, 0.01, 0.0]],
        hold="linear",
    )
    return pf.scenes.driven(
        model,
        twist=twist,
        normal_force=ramp((0.0, 0.9), (0.03, 2.0)),
        at="origin",
        t_end=0.03,
    )


def recorded(scene, **options):
    """Everything that a run gives."""
    solution = pf.simulate(scene, bristles="all", **options)
    counts = solution.statistics
    counted = np.array(
        [counts.steps, counts.rejections, counts.evaluations, counts.jacobians]
    )
    return {name: history.values for name, history in solution.histories.items()} | {
        "counts": counted
    }


def assert_same(one, other):
    assert one.keys() == other.keys()
    for name, values in one.items():
        np.testing.assert_array_equal(values, other[name], err_msg=name)


@pytest.mark.parametrize("of", [free, driven])
@pytest.mark.parametrize("name", MODELS)
def test_windows_leave_no_trace(monkeypatch, name, of):
    whole = recorded(of(MODELS[name]()))
    monkeypatch.setattr(packing, "BATCH", 3)
    assert_same(recorded(of(MODELS[name]())), whole)


@pytest.mark.parametrize("limit", ["MAX_PACK_BYTES", "MAX_PACK_SECONDS"])
@pytest.mark.parametrize("name", MODELS)
def test_windows_end_where_shapes_take_too_much_room_or_time(monkeypatch, name, limit):
    whole = recorded(free(MODELS[name]()))
    monkeypatch.setattr(limits, limit, 0.0)
    scene = free(MODELS[name]())
    if limit == "MAX_PACK_BYTES":
        sizes = [len(window.motion.row) for window in SegmentBatches(scene, 0.01)]
        assert sizes[0] == 1 or name == "reduced"  # many of its loads share one map
        assert sum(sizes) > len(sizes) / 2
    assert_same(recorded(scene), whole)


@pytest.mark.parametrize("name", MODELS)
def test_one_window_holds_all_shapes_whatever_they_take(monkeypatch, name):
    for limit in ("MAX_PACK_BYTES", "MAX_PACK_SECONDS"):
        monkeypatch.setattr(limits, limit, 0.0)
    (whole,) = SegmentBatches(free(MODELS[name]()), 0.02, most=MOST_PIECES)
    assert whole.motion.breaks[-1] == 0.02 and len(whole.motion.row) > 5


def test_windows_are_those_of_the_whole_motion():
    """Inputs, breaks and shapes of windows, put together, are those of one window."""
    scene = free(MODELS["distributed"]())
    (whole,) = SegmentBatches(scene, 0.035, most=10**6)
    parts = list(SegmentBatches(scene, 0.035, most=4))
    assert len(parts) > 5
    np.testing.assert_array_equal(
        np.concatenate([p.motion.breaks[:-1] for p in parts]), whole.motion.breaks[:-1]
    )
    for name in ("load", "force", "acceleration"):
        together = np.concatenate([getattr(part.motion, name) for part in parts])
        np.testing.assert_array_equal(together, getattr(whole.motion, name))


def test_shapes_are_refined_only_while_their_load_changes():
    soft = pf.DistributedModel(SOFT, LAW)
    load = ramp((0.0, 1.0), (0.1, 1.0), (0.1055, 2.0), (0.5, 2.0))
    scene = pf.Scene(pf.Body(1.0, 1.0), [pf.Contact(soft, load)], 0.5)
    pieces = Segments(scene, 0.5)
    breaks = pieces.breaks(np.arange(pieces.count + 1))
    assert pieces.count == 1 + 6 + 1
    np.testing.assert_allclose(
        breaks, [0.0, *np.linspace(0.1, 0.1055, 7), 0.5], rtol=1e-14
    )
    assert pieces.between(0) == pytest.approx((1.0, 2.0))
    assert pieces.settled == 0.1055
    assert Segments(scene, 0.102).settled == 0.102  # still changing at the end
    np.testing.assert_allclose(
        pieces.held(0, np.array([0, 3, 7])), [1.0, 1.0 + 2.5 / 6.0, 2.0], rtol=1e-12
    )


def test_cells_that_are_loaded_between_two_loads():
    for patch in (SOFT, MAPS):
        for low, high in ((0.4, 0.9), (1.2, 1.3), (1.5, 1.5), (2.0, 9.0), (0.1, 0.2)):
            loads = np.unique(
                np.concatenate(
                    [np.linspace(low, high, 40), [1.5] if low <= 1.5 <= high else []]
                )
            )
            expected = (patch.weights(loads) > 0.0).any(axis=0)
            np.testing.assert_array_equal(
                patch.pressure.ever_loaded(patch.positions, (low, high)), expected
            )


@pytest.mark.parametrize("name", ["distributed", "reduced", "published"])
def test_sensitivities_in_windows_and_in_parts(monkeypatch, name):
    scene = free(MODELS[name]())
    from planarfriction.derivatives import path as module

    numbers = {
        "parameters": ("mu", "r", "mass"),
        "options": pf.scenes.SolverOptions(t_end=0.025, save_every=1e-3),
    }
    whole = pf.derivatives.scene_sensitivities(scene, **numbers)
    monkeypatch.setattr(packing, "BATCH", 3)
    windows = pf.derivatives.scene_sensitivities(scene, **numbers)
    monkeypatch.setattr(module, "NUMBERS", 1.0)  # one step at a time
    parts = pf.derivatives.scene_sensitivities(scene, **numbers)
    for one in (windows, parts):
        for field in ("time", "motion", "wrenches"):
            np.testing.assert_array_equal(
                getattr(one, field), getattr(whole, field), err_msg=field
            )
        # derivatives go over several steps at once, fewer where a window or a part ends: to their own error
        for field in ("d_motion", "d_wrenches"):
            wanted = getattr(whole, field)
            error = np.abs(getattr(one, field) - wanted) / np.abs(wanted).max(
                axis=(0, -1), keepdims=True
            )
            assert error.max() < 2e-5, field
    assert np.abs(whole.d_motion).max() > 0.0


def test_a_body_comes_to_rest_in_a_later_window(monkeypatch):
    model = pf.DistributedModel(SOFT, LAW)
    load = ramp((0.0, 1.5), (0.02, 2.0))
    scene = pf.scenes.free_slide(
        model, mass=0.2, twist=(0.1, 0.0, 0.0), normal_force=load, t_end=1.0
    )
    whole = recorded(scene)
    monkeypatch.setattr(packing, "BATCH", 3)
    assert_same(recorded(scene), whole)
    assert pf.simulate(scene).status == "at rest"


def test_interruption_in_a_later_window_keeps_what_is_done(monkeypatch):
    monkeypatch.setattr(packing, "BATCH", 3)
    seen = []

    def stop(time):
        seen.append(time)
        if time > 0.015:
            raise KeyboardInterrupt

    with pytest.raises(pf.errors.SimulationInterrupted) as caught:
        pf.simulate(free(MODELS["reduced"]()), progress=stop)
    times = caught.value.solution.data.time
    assert 0.012 < float(times[-1]) < 0.02
    assert seen == sorted(seen)
    assert len(seen) >= 5  # once for each window


def test_interruption_while_shapes_are_built_keeps_what_is_done(monkeypatch):
    monkeypatch.setattr(packing, "BATCH", 3)
    shapes = type(MODELS["published"]().shapes)
    build = shapes._built
    calls = []

    def slow(self, load):
        calls.append(load)
        if len(calls) == 12:
            raise KeyboardInterrupt
        return build(self, load)

    monkeypatch.setattr(shapes, "_built", slow)
    with pytest.raises(pf.errors.SimulationInterrupted) as caught:
        pf.simulate(free(MODELS["published"]()))
    assert 0.003 < float(caught.value.solution.data.time[-1]) < 0.012


def peak(t_end, name):
    """Largest memory [B] that a run takes."""
    scene = pf.Scene(
        pf.Body(0.1, 1e-4),
        [pf.Contact(MODELS[name](), ramp((0.0, 0.5), (t_end, 3.0)))],
        t_end,
    )
    tracemalloc.start()
    try:
        pf.simulate(scene, rtol=1e-3, atol=1e-2, save_every=t_end)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("name", ["distributed", "published"])
def test_shapes_of_a_long_run_are_not_kept_together(monkeypatch, name):
    """With room for the shapes of 20 pieces, 150 pieces more take far less than their shapes."""
    size = {"distributed": 8 * 69, "published": 5 * 17 * 4 * 8}[name]
    peak(0.005, name)  # compiles, which takes memory too
    monkeypatch.setattr(limits, "MAX_PACK_BYTES", 20.0 * size)
    monkeypatch.setattr("planarfriction.models.reduced_published.REMEMBERED", 4)
    assert peak(0.2, name) - peak(0.05, name) < 0.4 * 150 * size


def test_pieces_that_no_run_would_end_are_refused():
    scene = pf.Scene(
        pf.Body(1.0, 1.0),
        [pf.Contact(MODELS["published"](), ramp((0.0, 1.0), (1e12, 2.0)))],
        1e12,
        save_every=1e11,
    )
    with refused(
        r"^t_end must be at most 1e\+09 s if the shape of a patch changes with the load, got 1",
        pf.FrictionError,
    ):
        pf.simulate(scene)


class Misfit(pf.ReducedModelPublished):
    """A model of one's own whose functions take other arguments than those with which they are called."""

    def packed(self, loads, between=None):
        found = super().packed(loads, between)
        functions = found.functions._replace(linearise=found.functions.evaluate)
        return found._replace(functions=functions)


def test_functions_with_other_arguments_are_refused():
    """Compiled callers would read and write elsewhere."""
    contact = pf.Contact(Misfit(FIXED, LAW), 2.0)
    with refused("linearise must take 6 arguments .* got 5"):
        pf.simulate(pf.Scene(pf.Body(mass=0.1, inertia=1e-4), [contact], t_end=0.01))
