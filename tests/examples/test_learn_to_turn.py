"""The example that learns to turn a plate: its environment, its search, and what the policies do."""

import contextlib

import numpy as np
import pytest

from tests.support.repository import script

pytest.importorskip(
    "mujoco", reason="needs MuJoCo: pip install 'planarfriction[mujoco]'"
)
pytest.importorskip(
    "gymnasium", reason="needs Gymnasium: pip install 'planarfriction[examples]'"
)

pytestmark = pytest.mark.mujoco

POLICY = 2.4, -9.0, 1.2, -0.1
"""Near what the search finds."""


@pytest.fixture(scope="module")
def example():
    return script("examples/learn_to_turn.py")


def missed(example, points, worlds=16):
    """Angles [degrees] that are left at the end in each world."""
    with contextlib.closing(example.TurnInHand(worlds, points=points)) as env:
        _, history = example.episode(env, np.tile(POLICY, (worlds, 1)), seed=5)
    return np.degrees(abs(history[-1, :, 0]))


def test_it_is_an_environment_of_gymnasium(example):
    with contextlib.closing(example.TurnInHand(3)) as env:
        first, _ = env.reset(seed=4)
        assert env.observation_space.contains(first) and first.shape == (3, 3)
        low, high = np.radians(example.TARGETS)
        assert ((first[:, 0] > low - 1e-3) & (first[:, 0] < high + 1e-3)).all()
        env.action_space.seed(0)
        action = env.action_space.sample()
        ends = [env.step(action) for _ in range(example.STEPS)]
        assert env.observation_space.contains(ends[0][0])
        assert not any(each[3].any() or each[1].any() for each in ends[:-1])
        assert ends[-1][3].all() and (ends[-1][1] < 0.0).all()
        again, _ = env.reset(seed=4)
        other, _ = env.reset(seed=5)
        np.testing.assert_array_equal(again, first)
        assert abs(other[:, 0] - first[:, 0]).min() > 1e-3


def test_worlds_have_friction_of_their_own(example):
    """The same force lets one plate slip, and not the other, at the friction that theory says."""
    with contextlib.closing(example.TurnInHand(2)) as env:
        env.reset(seed=0)
        drawn = [env.friction.parameters(m) for m in env.models]
        assert all(
            abs(drawn[0][name] - drawn[1][name]).min() > 1e-3
            for name in example.FRICTION
        )
        for m, mu in zip(env.models, (1.5, 0.7), strict=True):
            for name, value in (("mu_c", mu), ("mu_s", mu), ("scale", 1.0)):
                env.friction.parameters(m)[name][:] = value
        for _ in range(example.STEPS):
            env.step(np.full((2, 1), 3.0))
        angle = np.degrees(env.plates()[0])
    # both pads carry mu N r with r = 2/3 R, less what the weight takes: 3 N hold above mu = 0.84
    assert angle[0] < 0.1 and angle[1] > 5.0


def test_a_policy_for_patches_fails_with_points_on_the_rim(example):
    patches, rim, lever = (
        missed(example, points) for points in example.POINTS.values()
    )
    assert np.median(patches) < 2.0 and patches.max() < 8.0
    assert np.median(rim) > 2.0 * np.median(patches)
    assert np.median(lever) < 2.0


def test_the_search_finds_a_policy(example):
    with contextlib.closing(example.TurnInHand(16)) as env:
        _, rewards = example.learn(env, rounds=8)
    assert rewards[-1] > 0.5 * rewards[0]


def test_it_draws(example, tmp_path, capsys):
    example.main(["--out", str(tmp_path), "--rounds", "1", "--worlds", "16"])
    assert (tmp_path / "learn-to-turn.png").stat().st_size > 10_000
    assert (tmp_path / "learn-to-turn.gif").stat().st_size > 10_000
    assert (
        "on patches, learned with points at the rim: missed by"
        in capsys.readouterr().out
    )
