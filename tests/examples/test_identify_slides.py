"""The example that identifies slides, on slides that the library itself made."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import planarfriction as pf
from planarfriction.identify import MassProperties, Slide, fit_start
from planarfriction_studies.measured.tables import TABLES
from tests.support.refusals import refused
from tests.support.repository import script

MU = 0.31
RATE = 148.0  # samples per second, as measured


def slides(count=8):
    """Slides of a uniform square with friction MU, in the columns of the measured file.

    The first ends before the cube stops; the last two are one slide and its copy, rotated by 1 rad.
    """
    patch = pf.ContactPatch.rectangle(0.1048, cells=11)
    law = pf.LuGre(
        mu_c=MU,
        mu_s=MU,
        sigma_0=1e6,
        sigma_1=20.0,
        sigma_2=0.0,
        elasto_plastic=pf.ElastoPlastic(0.9),
    )
    random = np.random.default_rng(3)
    tables = []
    for toss in range(count):
        heading = random.uniform(-np.pi, np.pi)
        speed = random.uniform(0.3, 0.7)
        spin = random.uniform(-3.6, 3.6)
        start = (speed * np.cos(heading), speed * np.sin(heading), spin)
        scene = pf.scenes.free_slide(
            pf.DistributedModel(patch, law), mass=0.37, inertia=8.10e-4, twist=start
        )
        data = pf.simulate(scene, save_every=1.0 / RATE / 4, rtol=1e-4, atol=0.1).data
        time = np.arange(round((0.08 if toss == 0 else 0.35) * RATE)) / RATE
        # The whole slide, so that cubes start at any yaw.
        turn = random.uniform(-np.pi, np.pi)
        at = {
            name: np.interp(time, data.time, data[name])
            for name in ("x", "y", "theta", "vx", "vy", "omega")
        }
        (x, y) = turned(at["x"], at["y"], turn)
        (vx, vy) = turned(at["vx"], at["vy"], turn)
        columns = {
            "x_m": x,
            "y_m": y,
            "yaw_rad": at["theta"] + turn,
            "vx_mps": vx,
            "vy_mps": vy,
            "wz_radps": at["omega"],
        }
        sliding = (np.hypot(at["vx"], at["vy"]) > 0.02).astype(int)
        table = pd.DataFrame(
            {
                "toss": toss,
                "t_s": time,
                **columns,
                "sliding": sliding,
                "unique_id": 10 * toss,
            }
        )
        tables.append(table)
    last = tables[-1]
    (x, y) = turned(last.x_m, last.y_m, 1.0)
    (vx, vy) = turned(last.vx_mps, last.vy_mps, 1.0)
    tables.append(
        last.assign(
            toss=count, x_m=x, y_m=y, vx_mps=vx, vy_mps=vy, yaw_rad=last.yaw_rad + 1.0
        )
    )
    return pd.concat(tables)


def turned(x, y, angle):
    """Components of vectors turned counter-clockwise by `angle` [rad]."""
    return np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y


@pytest.fixture(scope="module")
def example():
    """The script as a module."""
    return script("examples/identify_slides.py")


def test_friction_radius_and_ends_come_out(example, tmp_path, monkeypatch, capsys):
    """Slides of a uniform square: its friction and radius, ends within 1 mm, and a picture."""
    slides(6).to_csv(tmp_path / TABLES["slides"], index=False)
    case = example.Case(
        "square", example.SQUARE, pf.DistributedModel, ("mu_c", "contact_radius")
    )
    # The first does not stop.
    tosses = [example.as_slide(toss) for toss in example.measured.read(tmp_path)][1:]
    rows = example.run(tosses[:4], tosses[4:], [case], 0)
    told = dict(part.split(" ± ")[0].split(" ") for part in rows[0][3].split(", "))
    # Bristles start relaxed: 1e-3 of the way.
    assert float(told["mu_c"]) == pytest.approx(MU, rel=5e-3)
    assert float(told["contact_radius"]) == pytest.approx(
        example.SQUARE.contact_radius(), rel=2e-2
    )
    assert all(float(row[4]) < 1.0 for row in rows)
    monkeypatch.setattr(example, "CASES", (example.CASES[0],))
    assert (
        example.main([str(tmp_path), "--tosses", "4", "--out", str(tmp_path / "out")])
        == 0
    )
    assert "square, mu" in capsys.readouterr().out
    assert (
        (tmp_path / "out" / "identify_slides.png").read_bytes().startswith(b"\x89PNG")
    )


def test_a_missing_file_is_one_line(example, capsys):
    assert example.main(["none"]) == 2
    assert (
        capsys.readouterr().err
        == f"error: {Path('none') / TABLES['slides']}: no such file\n"
    )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"body": 0.2}, "body must be MassProperties, got 0.2"),
        ({"slide": [1.0]}, "slide must be a Slide"),
        ({"noise": 0.1}, r"noise must have shape \[3\]"),
        ({"noise": (1e-3, 1e-3, 0.0)}, "noise must be > 0"),
        ({"samples": 5.5}, "samples must be an integer >= 5"),
    ],
)
def test_what_cannot_be_fitted_is_named_in_one_line(changes, message):
    time = np.linspace(0.0, 0.1, 11)
    legal = {
        "body": MassProperties(0.2, 1e-4),
        "slide": Slide(time, np.outer(0.1 * time, [1.0, 0.0, 0.0])),
    }
    with refused(message):
        fit_start(None, **{**legal, **changes})
