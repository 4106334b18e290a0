"""An observer on measured pushes and slides: the friction that it finds is that of a fit to the whole log."""

import gzip
import itertools

import numpy as np
import pytest

from tests.support import online_replay


@pytest.mark.parametrize(
    ("streams", "apart"),
    [
        (online_replay.push_streams, 0.03),
        (online_replay.slide_streams, 0.05),
    ],  # measured: medians of 1 % and 2 %
    ids=["pushes", "slides"],
)
def test_friction_on_the_way_is_that_of_the_whole_log(streams, apart):
    errors = []
    for stream in itertools.islice(streams(), 4):
        mu, interval, fit = online_replay.replay(stream)
        assert np.isfinite(mu).all()
        assert interval[-1, 0] < fit < interval[-1, 1]
        assert interval[-1, 1] / interval[-1, 0] < 1.6  # 7 at first
        errors.append(abs(mu[-1] / fit - 1.0))
    assert np.median(errors) < apart


def test_friction_of_a_slide_is_what_brakes_the_cube(tmp_path):
    time = np.arange(30) / 148.0
    mu = 0.3
    speed = 1.2 - mu * online_replay.GRAVITY * time
    names = "toss,unique_id,t_s,yaw_rad,vx_mps,vy_mps,wz_radps,sliding"
    rows = [
        f"1,1,{t},1.5707963267948966,0.0,{v},0.0,1"
        for t, v in zip(time, speed, strict=True)
    ]  # along its own x
    (tmp_path / "contactnets_slides.csv").write_text("\n".join([names, *rows]))

    packed = gzip.compress((tmp_path / "contactnets_slides.csv").read_bytes())
    (tmp_path / "contactnets_slides.csv.gz").write_bytes(packed)
    (stream,) = online_replay.slide_streams(tmp_path)
    assert stream.twist[0] == pytest.approx((1.2, 0.0, 0.0), abs=1e-12)
    assert stream.wrench[5] == pytest.approx((-mu * stream.load, 0.0, 0.0), abs=1e-9)
    found, _, fit = online_replay.replay(stream)
    assert (found[-1], fit) == pytest.approx((mu, mu), rel=0.01)
