"""Logs of random contacts and rigs: what is called identified is right, or the fit is rejected.

`python -m tests.identify.test_random_logs FIRST LAST` prints the counts of more seeds.
"""

import sys

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.derivatives import parameters_of
from planarfriction.identify import Log, identify_lugre
from planarfriction.identify.simulators import SIMULATORS, Prediction
from tests.support.identification_logs import truth

RATE, DURATION = 200.0, 6.0


def random_case(seed, varying=False):
    """A log of a random contact on a line, about a pivot, or in the plane; its patch, its law and its model.

    A load that varies does so by 30 to 100 %, and the stiffness follows it or not.
    """
    draw = np.random.default_rng(seed)
    kind = draw.choice(["line", "line", "pivot", "plane", "plane"])
    model = draw.choice(["reduced-published", "distributed"])
    speed = 10.0 ** draw.uniform(-2.0, -0.5)
    mu = draw.uniform(0.1, 1.0)
    bend = speed * 10.0 ** draw.uniform(-3.0, -1.0)
    law = pf.LuGre(
        mu_c=mu, mu_s=mu * draw.uniform(1.0, 3.0), v_s=speed * draw.uniform(0.03, 0.3), gamma=draw.uniform(0.8, 2.4),
        sigma_0=mu / bend, sigma_1=mu / bend * draw.uniform(0.0, 0.02), sigma_2=draw.uniform(0.0, 0.3) * mu / speed,
        elasto_plastic=None if draw.random() < 0.5 else 0.9,
    )  # fmt: skip
    patch = pf.ContactPatch.disc(0.01, cells=9)
    load = float(10.0 ** draw.uniform(0.0, 1.5))
    t = np.arange(round(DURATION * RATE)) / RATE
    columns = {"line": [0], "pivot": [2], "plane": [0, 1, 2]}[kind]
    twist = np.zeros((len(t), 3))
    for k in columns:
        scale = speed / (0.0067 if k == 2 else 1.0)
        if kind == "line" and draw.random() < 0.3:
            stairs = np.repeat(np.geomspace(0.01, 1.0, 10), -(-len(t) // 10))[: len(t)]
            twist[:, k] = scale * np.convolve(stairs, np.ones(20) / 20)[: len(t)]
        else:
            grown = np.exp(3.5 * (t / t[-1] - 1.0))
            rates = draw.uniform(0.3, 3.0, 2)
            twist[:, k] = (
                scale
                * grown
                * (
                    np.sin(2 * np.pi * rates[0] * t)
                    + 0.3 * np.sin(2 * np.pi * rates[1] * t)
                )
            )
    pad = None
    if varying:
        model = "reduced"
        rate = draw.uniform(0.2, 1.5)
        load = load * (
            1.0 + draw.uniform(0.3, 1.0) * (0.5 - 0.5 * np.cos(2.0 * np.pi * rate * t))
        )
        pad = None if draw.random() < 0.5 else pf.Pad.at_load(float(load.mean()))
    prediction = Prediction(
        SIMULATORS[model](patch, law, pad=pad),
        Log(t, twist, np.ones_like(twist), load),
        twist,
        refine=16,
    )
    vector = parameters_of(pf.ReducedModelPublished(patch, law))
    if model != "reduced-published":
        vector[8] = patch.contact_radius()
    size = draw.choice([0.0, 0.0, 1.0, 6.0])
    u = 2.0 * t / t[-1] - 1.0
    sizes = size * draw.standard_normal(8)
    wrench = (1.0 + 0.05 * 0.5 * sizes[0] * u)[:, None] * prediction.wrenches(
        vector, 0.004 * abs(sizes[1])
    )
    largest = np.abs(wrench).max(axis=0)
    wrench += largest * (0.05 * sizes[2:5] + 0.025 * sizes[5:8] * u[:, None])
    wrench += (
        draw.uniform(0.003, 0.03)
        * wrench.std(axis=0)
        * draw.standard_normal(wrench.shape)
    )
    wrench = np.where(np.isin(np.arange(3), columns), wrench, 0.0)
    true = {
        **truth(law, patch),
        **(
            {"contact_radius": float(patch.contact_radius())}
            if model != "reduced-published"
            else {}
        ),
    }
    return Log(t, twist, wrench, load, f"{kind} {seed}"), patch, pad, model, true, size


def judged(seed, model=None, varying=False):
    """Fit a random log; returns the result and the errors over standard errors of what is called identified."""
    log, patch, _, own, true, _ = random_case(seed, varying)
    found = identify_lugre(log, patch, model=model or own)
    inside = {}
    off = {}
    for name, (low, high) in found.intervals().items():
        if found.identifiable(name):
            inside[name] = bool(low <= true[name] <= high)
            off[name] = abs(found.estimates[name] - true[name]) / max(
                found.errors[name], 1e-300
            )
    return found, inside, off


@pytest.mark.slow
def test_what_is_called_identified_is_right():
    """Twelve logs: at least 85 % of the intervals hold the truth, three standard deviations below 95 %."""
    results = [judged(seed) for seed in range(12)]
    inside = [each for _, every, _ in results for each in every.values()]
    assert len(inside) > 20
    assert np.mean(inside) > 0.85
    assert max(each for _, _, every in results for each in every.values()) < 4.5


def test_a_rejected_kind_of_bristles_gives_way_to_one_that_explains_the_data():
    """This contact never slips: of the friction that it never shows, elasto-plastic bristles predict anything."""
    found, inside, _ = judged(301, "auto")
    assert not found.scores[0].rejected and any(each.rejected for each in found.scores)
    assert inside["sigma_0"] and not found.identifiable("mu_c")


@pytest.mark.slow
def test_loads_that_vary_within_a_log_tell_the_kind_of_stiffness():
    inside = []
    off = []
    for seed in range(6):
        found, hits, away = judged(seed, varying=True)
        pad = random_case(seed, varying=True)[2]
        assert (found.model.pad is None) == (pad is None), seed
        inside += hits.values()
        off += away.values()
    assert len(inside) > 15
    assert np.mean(inside) > 0.8  # three standard deviations below 95 % of so few
    assert max(off) < 4.5


if __name__ == "__main__":
    for number in range(*map(int, sys.argv[1:3])):
        case = random_case(number)
        result, hit, away = judged(number, *sys.argv[3:])
        worst = max(away, key=away.get, default="-")
        rejected = any(
            each.parameter == "fit" and not each.identifiable
            for each in result.verdicts
        )
        print(
            number, case[0].name, case[3], "plain" if case[2].elasto_plastic is None else "ep", f"rig {case[5]:g}",
            "REJECTED" if rejected else f"chi2 {result.scores[0].reduced_chi2:.2f}",
            result.law.elasto_plastic is None, len(hit), sum(hit.values()), sum(v > 3 for v in away.values()),
            f"{worst} {away.get(worst, 0.0):.1f}", f"{result.scores[0].held_out:.2f}", flush=True,
        )  # fmt: skip
