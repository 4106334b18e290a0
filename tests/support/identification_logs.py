"""Synthetic logs for the tests of identification, made on a sixteen times finer grid than they are read on."""

from __future__ import annotations

import dataclasses

import numpy as np

import planarfriction as pf
from planarfriction.derivatives import parameters_of
from planarfriction.identify import FitOptions, Identification, Log, identify_lugre
from planarfriction.identify.simulators import Prediction, PublishedSimulator

LAW = pf.LuGre(
    mu_c=0.5,
    mu_s=0.65,
    v_s=2e-3,
    gamma=1.4,
    sigma_0=2e4,
    sigma_1=30.0,
    sigma_2=0.8,
    elasto_plastic=pf.ElastoPlastic(0.9),
)
"""A soft contact: its bristles load over 30 um, some 30 samples of a slow start."""

PATCH = pf.ContactPatch.disc(0.01, cells=11)
LOAD = 2.0


def excitation(
    duration: float = 2.0, rate: float = 1000.0, speed: float = 0.03, spin: float = 2.0
):
    """Times `[T]` and twists `[T, 3]`: sines that grow from 3 % to all of `speed` [m/s] and `spin` [rad/s]."""
    t = np.arange(round(duration * rate)) / rate
    grown = np.minimum(1.0, 1.2 * np.exp(3.5 * (t / t[-1] - 1.0)))
    vx = speed * grown * np.sin(2 * np.pi * 2.3 * t)
    vy = (
        0.67
        * speed
        * grown
        * np.sin(2 * np.pi * 1.7 * t + 1.0)
        * np.minimum(1.0, 5.0 * t)
    )
    return t, np.stack([vx, vy, spin * grown * np.sin(2 * np.pi * 3.1 * t)], -1)


def clean_log(time, twist, *, law=LAW, patch=PATCH, load=LOAD, name="log") -> Log:
    """The log of a contact without noise."""
    model = pf.ReducedModelPublished(patch, law)
    empty = Log(time, twist, np.zeros_like(twist), load, name)
    wrench = Prediction(
        PublishedSimulator(patch, law), empty, twist, refine=16
    ).wrenches(parameters_of(model))
    return Log(time, twist, wrench, load, name)


def noisy(log: Log, seed: int, share: float = 0.01) -> Log:
    """The log with normal noise on every wrench channel, `share` of the channel's RMS."""
    spread = share * np.sqrt(np.mean(log.wrench**2, axis=0))
    random = np.random.default_rng(seed).standard_normal(log.wrench.shape)
    return Log(
        log.time, log.twist, log.wrench + spread * random, log.normal_force, log.name
    )


def truth(law=LAW, patch=PATCH) -> dict[str, float]:
    """The parameters that went in."""
    numbers = {
        name: getattr(law, name)
        for name in ("mu_c", "mu_s", "v_s", "gamma", "sigma_0", "sigma_1", "sigma_2")
    }
    return {
        **numbers,
        "contact_radius": pf.ReducedModelPublished(patch, law).surface.contact_radius,
    }


def fitted(log, patch=PATCH, **given) -> Identification:
    """Fit logs with keyword arguments of `identify_lugre` and fields of `FitOptions` alike."""
    names = {field.name for field in dataclasses.fields(FitOptions)}
    options = FitOptions(**{name: given.pop(name) for name in names & given.keys()})
    return identify_lugre(log, patch, options=options, **given)
