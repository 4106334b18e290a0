"""Pictures and films of a part in a gripper show what was recorded."""

import numpy as np
import pytest
from PIL import Image

from planarfriction.errors import FileError
from planarfriction_studies.rig import Parts
from planarfriction_studies.rig.demo import GripRecord, record_hold
from planarfriction_studies.rig.pictures import plot_grip, write_grip_film
from tests.support.refusals import refused


def record(rows=40):
    """A part that slides by 10 mm and turns by a quarter in 0.4 s."""
    share = np.linspace(0.0, 1.0, rows)
    zero = 0.0 * share
    slip = np.stack([zero, -0.01 * share, 0.5 * np.pi * share], axis=-1)
    lever = np.stack(
        [0.01 * np.cos(slip[:, 2]), 0.01 * np.sin(slip[:, 2]) - 0.01 * share], axis=-1
    )
    mu = np.stack([0.6 + zero, 0.4 + zero, 0.8 + zero], axis=-1)
    parts = Parts([0.2], [3e-4], [(0.01, 0.0)], [0.7])
    return GripRecord(
        parts,
        0.01 * np.arange(rows),
        slip,
        lever,
        zero,
        5.0 - share,
        0.005 + zero,
        mu,
        1.0 * (share > 0.5),
    )


def test_a_picture_shows_part_grip_and_band():
    part, grip, mu = plot_grip(record(), 20).axes
    assert grip.lines[0].get_ydata() == pytest.approx(record().grip[:21])
    assert mu.lines[0].get_ydata()[-1] == 0.6
    assert mu.lines[1].get_ydata()[0] == 0.7
    band = mu.collections[0].get_datalim(mu.transData)
    assert (band.y0, band.y1) == pytest.approx((0.4, 0.8))
    assert "slip" in part.get_title()


def test_the_cross_stays_where_the_part_was_gripped():
    # it slid by 10 mm downwards and turned about the grip: the cross is 10 mm below
    part = plot_grip(record()).axes[0]
    assert np.ravel(part.lines[-1].get_xydata()) == pytest.approx(
        (0.0, -10.0), abs=1e-9
    )
    assert part.get_title() == "slip 10.00 mm, 90.0 deg"


def test_a_film_has_a_frame_for_each_time(tmp_path):
    path = write_grip_film(tmp_path / "hold.gif", record())
    with Image.open(path) as film:
        assert film.n_frames == 8  # 0.39 s at 20 a second
    with refused("cannot write", FileError):
        write_grip_film(tmp_path / "hold.bmp", record())


def test_a_hold_is_recorded():
    found = record_hold(steps=60)
    assert found.time == pytest.approx(0.01 * np.arange(6) + 1e-3)
    assert found.mu_c[:, 1].max() < 0.52 < found.mu_c[:, 2].min()  # not known yet
    assert (found.grip > 10.0).all()
