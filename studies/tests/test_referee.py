"""The referee: its truths against a second way to each, its judgement of engines with known errors, and its files."""

from __future__ import annotations

import csv
import json
import math
import os
import platform
import re
import runpy
import sys
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from planarfriction.cli import main
from planarfriction.errors import FileError
from planarfriction_studies.referee import engines, report, truths
from planarfriction_studies.referee.case import (
    FOLDER,
    Body,
    Force,
    Shape,
    all_cases,
    read_case,
)
from planarfriction_studies.referee.engines.newton import NewtonWorld
from planarfriction_studies.referee.export import export_case, sdf
from planarfriction_studies.referee.pictures import film, outline, scene
from planarfriction_studies.referee.run import (
    Apart,
    Kept,
    Verdict,
    judge,
    no_result,
    run,
)
from tests.support.refusals import refused

CASES = all_cases()
TRUTHS = {
    f"{case.name} {truth.quantity} {truth.body}": truth
    for case in CASES.values()
    for truth in case.truths
    if truth.source != "held"
}
G = 9.81
MOTIONS = ("slide", "in_hand")
"""Sources that integrate the motion of a patch."""


# ---------------------------------------------------------------------- truths


@pytest.mark.parametrize(
    "name", [name for name, truth in TRUTHS.items() if truth.source not in MOTIONS]
)
def test_stated_values(name):
    truth = TRUTHS[name]
    assert abs(truths.value(truth.source, truth.given) - truth.value) <= truth.error


@pytest.mark.parametrize(
    "name", [name for name, truth in TRUTHS.items() if truth.source in MOTIONS]
)
def test_stated_motions(name):
    truth = TRUTHS[name]
    assert abs(truths.value(truth.source, truth.given) - truth.value) <= truth.error


def test_a_disc_is_a_patch():
    """The general motion against the disc's closed form: both have errors of 1e-9."""
    a = TRUTHS["disc x 10 rad/s"].given
    x, y, turn = truths.end(
        a["mu"], 0.2, 1e-3, 3.0, twist=(a["speed"], 0.0, a["spin"]), disc=a["radius"]
    )
    assert (x, y) == pytest.approx((TRUTHS["disc x 10 rad/s"].value, 0.0), abs=1e-8)
    assert turn == pytest.approx(TRUTHS["disc turn 10 rad/s"].value, abs=1e-8)


def dry(pull, bears, speed=0.0, *, time, dt=5e-5):
    """Path `[n, 2]` of time and displacement of a unit mass on dry friction, step by step."""
    x = 0.0
    v = speed
    path = [(0.0, 0.0)]
    for i in range(round(time / dt)):
        t = (i + 0.5) * dt
        u = v + dt * pull(t)
        u = math.copysign(max(abs(u) - dt * bears(t, v), 0.0), u)
        x = x + 0.5 * dt * (u + v)
        v = u
        path.append(((i + 1) * dt, x))
    return np.array(path)


def passes(path, threshold):
    return path[np.argmax(path[:, 1] > threshold), 0]


def second(source, a):
    """Compute a truth by small steps."""
    if source == "slope":
        across = a["mu"] * G * math.cos(a["tilt"])
        return dry(
            lambda t: G * math.sin(a["tilt"]), lambda t, v: across, time=a["time"]
        )[-1, 1]
    if source == "stop":
        way = dry(
            lambda t: 0.0,
            lambda t, v: a["mu"] * G,
            a["speed"],
            time=a["speed"] / (a["mu"] * G),
        )[-1, 1]
        return way * a.get("cosine", 1.0)
    if source == "stribeck_stop":
        curve = lambda t, v: (
            G * (a["mu_c"] + (a["mu_s"] - a["mu_c"]) * math.exp(-((v / a["v_s"]) ** 2)))
        )
        return dry(lambda t: 0.0, curve, a["speed"], time=0.5)[-1, 1]
    if source == "shaken":
        pull = lambda t: a["amplitude"] * math.sin(2.0 * math.pi * a["frequency"] * t)
        return dry(pull, lambda t, v: a["mu"] * G, time=a["time"])[-1, 1]
    if source == "grip_slips":
        load = lambda t, v: (
            2.0 * a["mu"] * max(a["load"] - a["rate"] * t, 0.0) / a["mass"]
        )
        return passes(dry(lambda t: G, load, time=1.5), a["threshold"])
    if source == "pad_turns":
        x = (np.arange(400) + 0.5) / 400 - 0.5
        bears = (
            2.0
            * a["mu"]
            * a["load"]
            * a["side"]
            * np.hypot(x, x[:, None]).mean()
            / a["inertia"]
        )
        return passes(
            dry(lambda t: a["rate"] * t / a["inertia"], lambda t, v: bears, time=1.5),
            a["threshold"],
        )
    assert source == "tower"
    moving = (a["above"] + 1) * a["mass"]
    return dry(lambda t: a["force"] / moving, lambda t, v: a["mu"] * G, time=a["time"])[
        -1, 1
    ]


@pytest.mark.parametrize(
    "name",
    [
        name
        for name, truth in TRUTHS.items()
        if truth.source not in (*MOTIONS, "disc", "measured")
    ],
)
def test_small_steps_agree(name):
    truth = TRUTHS[name]
    # Of a step of 50 us at 1 m/s.
    assert second(truth.source, truth.given) == pytest.approx(truth.value, abs=5e-5)


def cells(a, count=30):
    """Positions [n, 2] and shares of the load of small cells of a patch, with a linear pressure."""
    x = (np.arange(count) + 0.5) / count - 0.5
    unit = np.stack(np.meshgrid(x, x), axis=-1).reshape(-1, 2)
    if a.get("radius"):
        polar = np.stack(
            np.meshgrid(np.sqrt((np.arange(count) + 0.5) / count), 2.0 * math.pi * x),
            -1,
        ).reshape(-1, 2)
        points = (
            a["radius"]
            * polar[:, :1]
            * np.stack([np.cos(polar[:, 1]), np.sin(polar[:, 1])], axis=1)
        )
        return points, np.full(len(points), 1.0 / len(points))
    parts = [
        (unit * r[2:] + r[:2], np.full(len(unit), r[2] * r[3])) for r in a["rectangles"]
    ]
    points, shares = (np.concatenate(each) for each in zip(*parts, strict=True))
    return points, shares / shares.sum()


def moved(a):
    """Compute where a patch ends by small steps and a sum over cells."""
    (points, shares) = cells(a)
    dt = a["time"] / 4000
    centre = shares @ points
    mu = np.broadcast_to(a["mu"], 2)
    pose = np.zeros(3)
    twist = np.array(a.get("twist", (0.0, 0.0, 0.0)), dtype=float)
    masses = np.array([a["mass"], a["mass"], a["inertia"]])
    for _ in range(round(a["time"] / dt)):
        c = math.cos(pose[2])
        s = math.sin(pose[2])
        arms = (points - centre) @ np.array([[c, s], [-s, c]])
        velocities = twist[:2] + twist[2] * np.stack([-arms[:, 1], arms[:, 0]], axis=1)
        pulls = mu**2 * velocities
        sizes = np.sqrt((mu**2 * velocities**2).sum(1, keepdims=True))
        pulls = -pulls / np.maximum(sizes, 1e-6) * shares[:, None] * a["mass"] * G
        push = np.array(a.get("push", (0.0, 0.0)))
        arm = np.array([[c, -s], [s, c]]) @ (np.array(a.get("at", (0.0, 0.0))) - centre)
        torque = (
            (arms[:, 0] * pulls[:, 1] - arms[:, 1] * pulls[:, 0]).sum()
            + arm[0] * push[1]
            - arm[1] * push[0]
        )
        slower = twist + dt * np.array([*(pulls.sum(0) + push), torque]) / masses
        # The rest of the way is below 1e-5 m.
        if not push.any() and np.hypot(*twist[:2]) < 5e-3:
            break
        pose = pose + 0.5 * dt * (twist + slower)
        twist = slower
    c = math.cos(pose[2]) - 1.0
    s = math.sin(pose[2])
    x, y = pose[:2] - [c * centre[0] - s * centre[1], s * centre[0] + c * centre[1]]
    return {
        "x": x,
        "y": y,
        "turn": pose[2],
        "distance": math.hypot(x, y),
        "angle": pose[2],
    }


@pytest.mark.parametrize("name", ["line", "angle", "anisotropic", "push", "disc"])
def test_sums_over_cells_agree(name):
    case = CASES[name]
    known = [truth for truth in case.truths if truth.body == case.truths[0].body]
    a = dict(known[0].given)
    if name == "disc":
        a |= {
            "mass": 0.2,
            "inertia": 1e-3,
            "time": 1.2,
            "twist": (a["speed"], 0.0, a["spin"]),
        }
    found = moved(a)
    for truth in known:  # a tenth of what is allowed: of the cells, the steps, and the last millimetre per second
        assert abs(found[truth.given["what"]] - truth.value) < 0.1 * truth.allowed


def test_measured_slides_are_those_of_the_cube():
    """Friction and velocities of the case come from the tosses: the longest of those that spin fast."""
    tosses = truths.tosses()
    ends = {
        toss: tosses[tosses["toss"] == toss][-1] for toss in np.unique(tosses["toss"])
    }
    still = [
        k
        for k, end in ends.items()
        if max(abs(end["vx_mps"]), abs(end["vy_mps"]), 0.1 * abs(end["wz_radps"]))
        < 0.03
    ]
    slides = {k: truths.sliding(k) for k in still if (tosses["toss"] == k).sum() >= 25}
    ways = {k: math.hypot(*moved[:2]) for k, (_, moved) in slides.items()}
    mus = [
        v[:2] @ v[:2] / (2.0 * G * ways[k])
        for k, (v, d) in slides.items()
        if ways[k] > 0.03 and abs(d[2]) < math.radians(10)
    ]
    case = CASES["measured_slides"]
    assert case.contacts[0].mu[0] == pytest.approx(np.median(mus), rel=1e-3)
    fast = sorted(
        (k for k in slides if abs(slides[k][0][2]) > 1.0), key=lambda k: -ways[k]
    )[:3]
    assert fast == [truth.given["toss"] for truth in case.truths[::3]]
    for k, body in zip(fast, case.moving, strict=True):
        assert np.array(body.velocity)[[0, 1, 5]] == pytest.approx(
            slides[k][0], rel=1e-5
        )


def test_a_plate_ends_in_the_hand_where_a_sum_over_cells_says():
    known = CASES["in_hand"].truths
    a = known[0].given
    dt = 2.5e-4
    points, shares = cells({"radius": a["disc"]})
    place = -np.array(a["at"])
    turn = 0.0
    velocity = np.array([0.0, -1e-6])
    spin = 0.0  # from the pads
    for i in range(round(a["time"] / dt)):
        bears = 2.0 * a["mu"] * (a["load"] + a["rate"] * (i + 0.5) * dt)
        arms = points - place
        moves = velocity + spin * np.stack([-arms[:, 1], arms[:, 0]], axis=1)
        # The rest of the way is below 1e-5 m.
        if i > 400 and np.sqrt((moves**2).mean()) < 2e-3:
            break
        pulls = (
            -bears
            * shares[:, None]
            * moves
            / np.linalg.norm(moves, axis=1, keepdims=True)
        )
        before = velocity
        velocity = velocity + dt * (pulls.sum(0) / a["mass"] - [0.0, G])
        spin += (
            dt
            * (arms[:, 0] * pulls[:, 1] - arms[:, 1] * pulls[:, 0]).sum()
            / a["inertia"]
        )
        place = place + 0.5 * dt * (before + velocity)
        turn = turn + dt * spin
    found = dict(zip(("x", "y", "turn"), (*(place + a["at"]), turn), strict=True))
    for truth in known:
        assert abs(found[truth.quantity] - truth.value) < 0.2 * truth.allowed


@pytest.mark.parametrize(
    "name",
    ["off_centre", "capsule", "shaken_grip", "hold", "cycled_load", "round_pads"],
)
def test_what_is_held_can_be_held(name):
    """Shares of the largest force and torque sum to less than 1: the limit surface is convex."""
    case = CASES[name]
    middle = np.zeros((len(case.moving), 3))
    upright = np.tile(np.eye(3), (len(case.moving), 1, 1))
    names = [body.name for body in case.moving]
    worst = 0.0
    for t in np.linspace(0.0, case.time, 301):
        wrenches = dict(zip(names, case.wrenches(t, middle, upright), strict=True))
        for contact in case.contacts:
            body = next(
                case.shapes[each][0]
                for each in contact.pair
                if case.shapes[each][0].joint == "free"
            )
            force = wrenches[body.name][:3] + body.mass * np.array(case.gravity)
            pad = wrenches.get("upper", wrenches.get(f"{body.name} above"))
            bears = contact.mu[0] * (-force[2] if pad is None else -2.0 * pad[2])
            at = (
                np.array(case.shapes[contact.pair[1]][0].position)
                + contact.at
                - body.position
            )[:2]
            round_one = len(contact.patch) == 1
            points, shares = cells(
                {"radius": contact.patch[0]}
                if round_one
                else {"rectangles": [[0.0, 0.0, *contact.patch]]}
            )
            torque = abs(at[0] * force[1] - at[1] * force[0]) / (
                shares @ np.hypot(*points.T)
            )
            worst = max(worst, (np.hypot(*force[:2]) + torque) / bears)
    assert 0.05 < worst < 0.95


# ---------------------------------------------------------------------- judgement


@dataclass(frozen=True)
class Fake:
    """An engine that knows the truth of `stop`, and misses it by a share of what is allowed."""

    share: float
    name: str = "fake"
    settings: str = "none"
    package: str = "numpy"

    def cannot(self, case):
        return "nothing" if self.share < 0.0 else None

    def build(self, case, dt):
        if math.isinf(self.share):
            raise RuntimeError("no\nsuch contact")
        return FakeWorld(case, dt, self.share)


class FakeWorld:
    def __init__(self, case, dt, share):
        self.case = case
        self.steps = 0
        self.thrown = {}
        self.settle = round(case.settle / dt)
        self.count = round(case.time / dt)
        self.ends = [truth.value + share * truth.allowed for truth in case.truths]

    def step(self, wrenches):
        assert wrenches.shape == (len(self.case.moving), 6)
        self.steps += 1

    def poses(self):
        done = max(self.steps - self.settle, 0) / self.count
        positions = np.array([[3.0 + done * end, 1.0, 0.0] for end in self.ends])
        return positions, np.tile(np.eye(3), (len(positions), 1, 1))

    def throw(self, body, velocity):
        self.thrown[body] = velocity


@pytest.mark.parametrize(
    ("share", "mark"),
    [
        (0, "ok"),
        (0.9, "ok"),
        (1.1, "off"),
        (9, "off"),
        (11, "fails"),
        (math.nan, "fails"),
        (math.inf, "fails"),
        (-1, "-"),
    ],
)
def test_a_known_error_is_found(share, mark):
    verdict = judge(CASES["stop"], Fake(share))
    assert verdict.mark == mark
    if math.isfinite(share) and share >= 0.0:
        assert verdict.error / verdict.allowed == pytest.approx(share, abs=1e-9)
        assert verdict.cost >= 0.0
    else:
        assert verdict.error is None and verdict.reason and "\n" not in verdict.reason


def test_what_an_engine_lacks_is_no_failure():
    class Lacking(Fake):
        def build(self, case, dt):
            raise NotImplementedError("no cylinders")

    verdict = judge(CASES["stop"], Lacking(0.0))
    assert (verdict.mark, verdict.reason) == ("-", "no cylinders")


@dataclass(frozen=True)
class Crashing(Fake):
    """An engine that ends its process in one case."""

    def build(self, case, dt):
        if case.name == "disc":
            os._exit(3)
        return super().build(case, dt)


def test_a_crash_is_one_failure():
    kept = Kept()
    cases = {name: CASES[name] for name in ("disc", "stop")}
    engines = [Crashing(0.5)]
    with Apart() as apart:
        run(cases, engines, kept, judged=apart.judge)
    assert [(each.mark, each.reason) for each in kept.of(cases, engines)] == [
        ("fails", "the engine ended the process"),
        ("ok", ""),
    ]


def test_numbers_of_a_table_have_their_units():
    error = 2.5e-5
    allowed = 1e-4
    dt = 2e-3
    cost = 3e-5
    start = 0.24
    good = Verdict("stop", "A", "ok", error, allowed, "m", "x of box", dt, cost, start)
    bad = replace(good, case="disc", mark="fails", error=1.5e-3, cost=5e-5, start=0.5)
    headings, rows = report.table([good, bad])
    assert headings == ["case", "A"]
    assert rows == [
        ["stop", "ok 0.25"],
        ["disc", "fails 15"],
        ["ok", "1 of 2"],
        ["median step [µs]", "40"],
        ["median start [s]", "0.4"],
    ]
    assert [report.shown(each) for each in (good, bad)] == ["25 µm", "1.5 mm"]
    assert report._numbers(good) == [
        "2.5e-05 m",
        "0.0001 m",
        "x of box",
        "2 ms",
        "30",
        "0.24",
    ]
    dots = [
        line.get_xdata()[0]
        for line in report.picture("stop", [good, bad]).axes[0].get_lines()
    ]
    assert dots == pytest.approx([0.25, 1.0])  # over what is allowed; the line


def test_the_worst_time_step_counts():
    class Coarse(Fake):
        def build(self, case, dt):
            return FakeWorld(case, dt, dt / 1e-3)

    verdict = judge(CASES["stop"], Coarse(0.0), (1e-3, 4e-3, 2e-3))
    assert verdict.dt == 4e-3 and verdict.error / verdict.allowed == pytest.approx(4.0)


def test_the_command_judges_with_its_time_step(monkeypatch, capsys, tmp_path):
    asked = []
    monkeypatch.setattr(engines, "installed", lambda left_out: iter([Fake(0.5)]))
    monkeypatch.setattr(
        Apart, "judge", lambda self, *given: asked.append(given[2]) or judge(*given)
    )
    for step in ([], ["--step", "0.004"]):
        assert main(["referee", "--case", "stop", *step]) == 0
    assert asked == [None, (0.004,)]


def test_an_interrupt_tells_how_much_is_done(monkeypatch, capsys, tmp_path):
    judged = []

    def stop(self, *given):
        if len(judged) == 3:
            raise KeyboardInterrupt
        judged.append(judge(*given))
        return judged[-1]

    monkeypatch.setattr(
        engines,
        "installed",
        lambda left_out: iter([Fake(0.5), Fake(2.0, name="other")]),
    )
    monkeypatch.setattr(Apart, "judge", stop)
    file = str(tmp_path / "referee.json")
    assert main(["referee", "--case", "stop", "--case", "disc", "--json", file]) == 130
    told = " ".join(capsys.readouterr().err.split())
    assert (
        "interrupted: 3 of 4 results are finished: the same command continues from there"
        in told
    )


def test_what_is_done_is_kept(tmp_path):
    def stop(done, of, words):
        assert of == 2
        if done == 1 and len(judged) == 1:
            raise KeyboardInterrupt

    def judging(case, engine, steps):
        judged.append(engine.name)
        return judge(case, engine, steps)

    judged = []
    file = tmp_path / "referee.json"
    cases = {"stop": CASES["stop"]}
    engines = [Fake(0.0), Fake(2.0, name="other")]
    with pytest.raises(KeyboardInterrupt):
        run(cases, engines, Kept(file), judged=judging, progress=stop)
    assert [row["mark"] for row in json.loads(file.read_text())] == ["ok"]
    for _ in range(2):
        run(cases, engines, Kept(file), judged=judging)
        assert judged == ["fake", "other"]
    # another time step, another case, other settings: done again, in place of what was there
    for change in (
        {"steps": (1e-3,)},
        {"cases": {"stop": replace(CASES["stop"], time=0.7)}},
    ):
        run(
            **{
                "cases": cases,
                "engines": engines[:1],
                "kept": Kept(file),
                "judged": judging,
            }
            | change
        )
    run(cases, [Fake(0.0, settings="others")], Kept(file), judged=judging)
    assert judged == ["fake", "other", *["fake"] * 3]
    assert [each.mark for each in Kept(file).of(cases, engines)] == ["ok", "off"]


def test_a_file_of_something_else_stays(tmp_path):
    for number, text in enumerate(["no JSON", "3", '[{"case": "stop"}]', '["stop"]']):
        file = tmp_path / f"{number}.json"
        file.write_text(text)
        with refused("has no verdicts", FileError):
            Kept(file)
        assert file.read_text() == text


def test_each_quantity():
    case = CASES["disc"]
    times = np.linspace(0.0, 1.0, 11)
    places = np.zeros((11, 3, 3))
    places[:, 0, 0] = 2.0 + times
    places[:, 0, 1] = 1.0 - 2.0 * times
    turns = np.zeros((11, 3))
    turns[:, 0] = 0.3 + 4.0 * times**2
    from planarfriction_studies.referee.case import Path3

    def of(quantity, threshold=0.0):
        truth = replace(case.truths[0], quantity=quantity, threshold=threshold)
        return case.measure(truth, Path3(times, places, turns))

    assert [of("x"), of("y"), of("turn")] == pytest.approx([1.0, -2.0, 4.0])
    assert [of("moved"), of("drift")] == pytest.approx([math.sqrt(5.0), math.sqrt(5.0)])
    assert of("slips", 0.25 * math.sqrt(5.0)) == pytest.approx(0.25)
    assert [of("turns", 1.0), of("turns", 9.0)] == pytest.approx([0.5, 1.0])


# ---------------------------------------------------------------------- cases and files


def test_cases_are_whole():
    assert len(CASES) >= 14
    for case in CASES.values():
        assert case.title and case.about.strip() and case.why.strip() and case.truths
        assert all(truth.allowed > 10.0 * truth.error for truth in case.truths)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('quantity = "x"', 'quantity = "z"', "'z' is not one of the quantities"),
        ('body = "0.3 m/s"', 'body = "none"', "'none' is not one of the moving bodies"),
        (
            'pair = ["floor", "0.3 m/s"]',
            'pair = ["roof", "0.3 m/s"]',
            "'roof' is not one of the shapes",
        ),
        ("mass = 0.3", "weight = 0.3", "unexpected keyword argument 'weight'"),
    ],
)
def test_a_mistake_is_one_line(tmp_path, old, new, words):
    path = tmp_path / "mine.toml"
    path.write_text((FOLDER / "stop.toml").read_text().replace(old, new))
    with refused(words, FileError):
        read_case(path)


def rows_of(path):
    return list(csv.DictReader(path.read_text().splitlines()))


@pytest.mark.parametrize("command", ["referee", "simulators"])
def test_without_any_engine_one_line_says_so(command, monkeypatch, capsys):
    monkeypatch.setattr(engines, "MODULES", {"mujoco": "no_such_package"})
    assert main([command, "--case", "stop"]) == 2
    assert capsys.readouterr().err.startswith(
        "error: no simulator is installed: run pip install"
    )
    assert main([command, "--case", "stop", "--engine", "MuJoCo"]) == 2
    assert capsys.readouterr().err.endswith(
        "an engine that is installed: none, got MuJoCo\n"
    )


def test_export(tmp_path):
    for name in ("push", "ramp"):
        export_case(CASES[name], tmp_path)
    rows = rows_of(tmp_path / "push-forces.csv")
    assert {row["fx [N]"] for row in rows} == {"2.5"}
    assert float(rows[0]["tz [N m]"]) == pytest.approx(-2.5 * 0.015)
    inclines = {row["body"]: row for row in rows_of(tmp_path / "ramp-forces.csv")}
    assert float(inclines["0.4 0.25"]["fx [N]"]) == pytest.approx(
        0.3 * G * math.sin(0.4)
    )
    truth = rows_of(tmp_path / "push-truth.csv")[0]
    assert float(truth["value"]) == CASES["push"].truths[0].value
    assert read_case(tmp_path / "push.toml") == CASES["push"]


@pytest.mark.mujoco
def test_exported_bodies_are_those_of_the_case(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    case = CASES["angle"]
    export_case(case, tmp_path)
    m = mujoco.MjModel.from_xml_path(str(tmp_path / "angle.xml"))
    body = m.body("foot")
    assert body.mass[0] == case.moving[0].mass and np.allclose(
        body.ipos, case.moving[0].centre_of_mass
    )
    assert (
        np.allclose(sorted(body.inertia), sorted(case.moving[0].moments))
        and m.npair == 2
    )


def test_sdf_has_the_bodies_and_friction(tmp_path):
    for name in ("in_hand", "anisotropic", "stribeck"):
        export_case(CASES[name], tmp_path)
    assert sorted(path.stem for path in tmp_path.glob("*.sdf")) == [
        "anisotropic",
        "in_hand",
    ]
    mus = [
        ElementTree.parse(tmp_path / "anisotropic.sdf").findall(f".//{name}")[1].text
        for name in ("mu", "mu2")
    ]
    assert tuple(map(float, mus)) == CASES["anisotropic"].contacts[0].mu


def test_pictures_show_where_bodies_end():
    axes = scene(CASES["in_hand"]).axes[0]
    pads_and_plate = axes.patches[:-1]
    (end,) = axes.patches[-1:]
    assert len(pads_and_plate) == 3 and end.get_linestyle() == "--"
    x, y = end.get_xy()[:-1].mean(0)
    assert (x, y) == pytest.approx(
        [1e3 * truth.value for truth in CASES["in_hand"].truths[:2]], abs=1e-9
    )


def test_outlines_are_those_of_turned_and_shifted_shapes():
    """A box off the middle of a body that turns, from above and from the side; the length of what is round."""
    shape = Shape("box", "box", (0.2, 0.1, 0.06), (0.03, -0.02, 0.01))
    body = Body("plate", [shape], (1.0, 2.0, 3.0))
    turn = 0.5
    corners = np.array([[-0.07, -0.07], [0.13, -0.07], [0.13, 0.03], [-0.07, 0.03]]) @ [
        1.0,
        1.0j,
    ]
    turned = np.exp(1j * turn) * corners + complex(1.04, 2.05)
    found = outline(body, shape, 1, 0.04, 0.05, turn)
    np.testing.assert_allclose(found @ [1.0, 1.0j], turned, atol=1e-12)
    aside = outline(body, shape, 2, 0.04, 0.05)
    expected = [[0.97, 2.98], [1.17, 2.98], [1.17, 3.04], [0.97, 3.04]]
    np.testing.assert_allclose(aside, expected, atol=1e-12)
    rod = Shape("rod", "cylinder", (0.05, 0.3), axis=(1.0, 0.0, 0.0))
    np.testing.assert_allclose(rod.half, [0.15, 0.05, 0.05])
    np.testing.assert_allclose(
        Shape("pill", "capsule", (0.05, 0.3)).half, [0.05, 0.05, 0.2]
    )
    coin = Shape("coin", "cylinder", (0.05, 0.01))
    np.testing.assert_allclose(np.hypot(*(outline(body, coin, 1) - [1.0, 2.0]).T), 0.05)
    np.testing.assert_allclose(np.ptp(outline(body, coin, 2), axis=0), [0.1, 0.01])
    heavy = Body("box", [Shape("box", "box", (0.3, 0.2, 0.1))], mass=1.2)
    np.testing.assert_allclose(
        heavy.moments, 0.1 * np.array([0.04 + 0.01, 0.09 + 0.01, 0.09 + 0.04])
    )


def test_forces_act_where_and_when_a_case_says():
    """A pull at a point of a turned body, a sine beside a ramp, an incline of its own, and the time of settling."""
    values = [[1.0, 2.0, -3.0, 0.1, 0.2, 0.3], [3.0, 2.0, -3.0, 0.1, 0.2, 0.3]]
    sine = {"amplitude": (0.0, 0.5, 0.0, 0.0, 0.0, 0.0), "frequency": 2.0, "phase": 0.3}
    force = Force("a", values, (0.0, 1.0), at=(0.1, 0.05, 0.02), **sine)
    bodies = [
        Body("a", [], mass=2.0, centre_of_mass=(0.01, 0.0, 0.0), tilt=0.4),
        Body("b", [], mass=3.0),
        Body("floor", [], joint="fixed"),
    ]
    case = replace(
        CASES["stop"], bodies=bodies, forces=[force], gravity=(0.5, 0.0, -9.0)
    )
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    places = np.zeros((2, 3))
    turns = np.stack([turn, np.eye(3)])
    pull = np.array([1.5, 2.0 + 0.5 * math.sin(math.pi + 0.3), -3.0])
    incline = 2.0 * (
        -9.0 * np.array([-math.sin(0.4), 0.0, math.cos(0.4)]) - [0.5, 0.0, -9.0]
    )
    torque = np.cross([-0.05, 0.09, 0.02], pull) + np.array([0.1, 0.2, 0.3])
    found = case.wrenches(0.25, places, turns)
    np.testing.assert_allclose(
        found, [[*(pull + incline), *torque], np.zeros(6)], atol=1e-12
    )
    settling = case.wrenches(None, places, turns)
    down = np.cross([-0.05, 0.09, 0.02], [0.0, 0.0, -3.0])
    np.testing.assert_allclose(
        settling,
        [[-1.0, 0.0, -3.0, *down], [-1.5, 0.0, 0.0, 0.0, 0.0, 0.0]],
        atol=1e-12,
    )


def test_films_go_to_where_an_engine_ends():
    case = CASES["stop"]
    verdicts = [
        judge(case, Fake(0.5)),
        replace(judge(case, Fake(2.0)), engine="a & b"),
        no_result("-", case, Fake(0), ""),
    ]
    panels = ElementTree.fromstring(film(case, verdicts)).findall("{*}svg")
    assert len(panels) == 2
    for panel, verdict in zip(panels, verdicts, strict=False):
        goes = (
            panel.find(".//{*}animateTransform[@type='translate']")
            .get("values")
            .split(";")
        )
        first, last = (float(goes[i].split(",")[0]) for i in (0, -1))
        ways = {truth.body: truth.value for truth in case.truths}
        allowed = {truth.body: truth.allowed for truth in case.truths}
        body = verdict.quantity.partition(" of ")[2]
        share = verdict.error / verdict.allowed
        assert last - first == pytest.approx(
            ways[body] + share * allowed[body], rel=1e-3
        )


@pytest.mark.drake
@pytest.mark.parametrize("name", ["in_hand", "angle"])
def test_drake_reads_the_sdf(name):
    pytest.importorskip("pydrake")
    from pydrake.geometry import SceneGraph
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    case = CASES[name]
    plant = MultibodyPlant(2e-3)
    scene_graph = SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    Parser(plant).AddModelsFromString(sdf(case, 2e-3), "sdf")
    plant.Finalize()
    assert plant.num_velocities() == sum(
        {"free": 6, "slide": 1}[body.joint] for body in case.moving
    )
    for body in case.moving:
        own = plant.GetBodyByName("link", plant.GetModelInstanceByName(body.name))
        assert own.default_mass() == body.mass
        assert np.allclose(own.default_com(), body.centre_of_mass)


@pytest.mark.mujoco
def test_mujoco(tmp_path, capsys):
    pytest.importorskip("mujoco")
    file = tmp_path / "referee.json"
    folder = tmp_path / "out"
    names = ["stop", "heading", "off_middle"]
    arguments = [
        "--engine",
        "MuJoCo",
        *(part for name in names for part in ("--case", name)),
    ]
    assert main(["referee", *arguments, "--json", str(file), "--out", str(folder)]) == 0
    rows = {row["case"]: row for row in json.loads(file.read_text())}
    assert all(
        row.keys() >= {"case", "engine", "error", "allowed", "cost"}
        for row in rows.values()
    )
    # a pyramid knows directions, and the known fault shows as such
    assert {name: rows[name]["mark"] for name in names} == {
        "stop": "ok",
        "heading": "fails",
        "off_middle": "ok",
    }
    assert "fails" in capsys.readouterr().out
    stored = json.loads((folder / "referee.json").read_text())
    assert stored["settings"].keys() == {"MuJoCo"} and stored["versions"]["mujoco"]
    assert (
        stored["date"]
        and platform.machine() in stored["machine"]
        and platform.python_version() in stored["machine"]
    )
    page = (folder / "referee.html").read_text()
    assert page.count("<h2 id=") == len(names)
    assert all(
        (folder / picture).exists() for picture in re.findall(r'src="(.*?)"', page)
    )


def test_the_view_of_simulators(monkeypatch, capsys, tmp_path):
    own = [
        Fake(9.0, "A"),
        Fake(2.0, "A, firm"),
        Fake(0.5, "A, best"),
        Fake(0.0, "A, patches"),
        Fake(0.0, "B"),
    ]
    monkeypatch.setattr(engines, "installed", lambda left_out: iter(own))
    monkeypatch.setattr(Apart, "judge", lambda self, *given: judge(*given))
    file = str(tmp_path / "referee.json")
    assert main(["simulators", "--case", "stribeck", "--json", file]) == 0
    lines = capsys.readouterr().out.replace("┃", "│").splitlines()
    heading, row = (
        [each.strip() for each in line.split("│")[1:-1]]
        for line in lines
        if "case" in line or "stri" in line
    )
    assert heading == ["case", "A", "A, best", "A, patches"]
    # 9, 0.5 and 0 times the 2.6 mm that are allowed.
    assert row == [
        "stribeck",
        "23 mm",
        "1.3 mm",
        "< 0.001 nm",
    ]


class StubbedNewton:
    """The parts of Newton that a world calls: states that hold forces and poses, and a solver that adds up forces."""

    body_count = 3

    def __init__(self, monkeypatch):
        monkeypatch.setitem(sys.modules, "newton", self)
        self.collided = []

    def state(self):
        names = {"body_f": 6, "body_q": 7, "body_qd": 6, "joint_q": 7, "joint_qd": 6}
        return SimpleNamespace(
            **{name: Column((3, count)) for name, count in names.items()}
        )

    def eval_ik(self, model, state, q, qd):
        assert (q, qd) == (state.joint_q, state.joint_qd)
        qd.assign(state.body_qd.numpy())

    def control(self):
        return "control"

    def CollisionPipeline(self, model):
        return SimpleNamespace(
            contacts=lambda: "contacts",
            collide=lambda state, contacts: self.collided.append(state),
        )

    def step(self, now, after, control, contacts, dt):
        assert (control, contacts, dt) == ("control", "contacts", 2e-3)
        after.body_q.values = (
            now.body_q.values + now.body_f.values[:, [0, 1, 2, 3, 4, 5, 0]]
        )


class Column:
    def __init__(self, shape):
        self.values = np.zeros(shape)

    def assign(self, values):
        self.values = np.array(values)

    def numpy(self):
        return self.values.copy()


def test_a_step_of_newton_goes_on_from_the_last_one(monkeypatch):
    """Bodies 2 and 0 of three, whose poses grow by the forces of each step."""
    stub = StubbedNewton(monkeypatch)
    world = NewtonWorld(CASES["stop"], stub, [2, 0], stub, 2e-3)
    forces = np.arange(12.0).reshape(2, 6)
    for _ in range(3):
        world.step(forces)
    positions, _ = world.poses()
    np.testing.assert_array_equal(positions, 3.0 * forces[:, :3])
    assert len({id(state) for state in stub.collided}) == 2  # in turn
    half = np.sqrt(0.5)
    first = [1.0, 2.0, 3.0, 0.0, 0.0, half, half]
    last = [4.0, 5.0, 6.0, half, 0.0, 0.0, half]
    world._now.body_q.values = np.array([first, 7 * [0.0], last])
    positions, turns = world.poses()
    np.testing.assert_array_equal(positions, [[4.0, 5.0, 6.0], [1.0, 2.0, 3.0]])
    about_x = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
    about_z = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    np.testing.assert_allclose(turns, [about_x, about_z], atol=1e-12)


def test_newton_throws_a_body_and_the_joint_that_leaves_it_free(monkeypatch):
    stub = StubbedNewton(monkeypatch)
    velocity = np.arange(1.0, 7.0)
    world = NewtonWorld(CASES["stop"], stub, [2, 0], stub, 2e-3)
    world.throw(1, velocity)
    for speeds in (world._now.body_qd, world._now.joint_qd):
        np.testing.assert_array_equal(
            speeds.numpy(), [velocity, np.zeros(6), np.zeros(6)]
        )


SOURCES = {
    "pybullet": "the extra [pybullet], which `make test` leaves out",
    "newton": "pip install newton, which no extra names",
    "mujoco_warp": "the extra [mujoco-warp]",
}
"""Where engines come from that no extra of their name brings."""


@pytest.mark.parametrize(
    "name",
    [
        "drake",
        "pybullet",
        pytest.param("mujoco_warp", marks=pytest.mark.mujoco_warp),
        pytest.param("newton", marks=pytest.mark.slow),
        pytest.param("mjx", marks=[pytest.mark.mjx, pytest.mark.slow]),
    ],
)
def test_other_engines_stop(name):
    package = engines.MODULES[name]
    pytest.importorskip(
        package, reason=f"needs {package}: {SOURCES.get(name, f'the extra [{name}]')}"
    )
    module = __import__(
        f"planarfriction_studies.referee.engines.{name}", fromlist=["ENGINES"]
    )
    verdicts = [judge(CASES[case], module.ENGINES[0]) for case in ("stop", "stribeck")]
    assert [each.mark for each in verdicts] == ["ok", "-"], verdicts[0].reason


@pytest.mark.slow
@pytest.mark.mujoco
def test_patches_pass():
    pytest.importorskip("mujoco")
    from planarfriction_studies.referee.engines.mujoco import ENGINES

    patches = next(engine for engine in ENGINES if engine.name == "MuJoCo, patches")
    marks = {
        name: judge(CASES[name], patches).mark
        for name in ("hold", "push", "line", "anisotropic", "stribeck")
    }
    assert set(marks.values()) == {"ok"}, marks


def test_the_page_shows_the_stored_run():
    docs = Path(__file__).parents[2] / "docs"
    if not docs.is_dir():
        pytest.skip("no docs beside these tests")
    maker = runpy.run_path(str(docs / "make_referee.py"))
    stored = json.loads((docs / "referee.json").read_text())
    for path in maker["PAGES"]:
        page = path.read_text(encoding="utf-8")
        assert maker["filled"](page, stored) == page
        assert (
            all(words in page for words in maker["ROWS"].values())
            or path.name != "README.md"
        )
    for page in ("README.md", "CHANGELOG.md", "docs/referee.md"):
        counts = re.findall(
            r"(\d+)\s+(?:small\s+|exact\s+)?cases",
            (docs.parent / page).read_text(encoding="utf-8"),
        )
        assert {*counts} == {str(len(CASES))}, page
    assert {row["case"] for row in stored["verdicts"]} == set(CASES)
    assert all(
        row["allowed"] in [truth.allowed for truth in CASES[row["case"]].truths]
        for row in stored["verdicts"]
    )
