"""A log of ten seconds at 1 kHz that is identified: what the fit of all parameters costs."""

from __future__ import annotations

import time

import numpy as np

from planarfriction.derivatives import rollout
from planarfriction.identify import FitOptions, Log, identify_lugre
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.models import DistributedModel, ReducedModelPublished
from planarfriction.patch import ContactPatch
from planarfriction_studies.bench.measurement import Measurement, line

LOAD, RATE, DURATION = 2.0, 1000, 10.0

SHARE = 0.01
"""Noise of each wrench channel over its root mean square."""


def identification(full: bool, model: str = "reduced-published") -> Measurement:
    """Measure a fit with the distributed model, or with the published reduced one."""
    value, plain = identification_times(model)
    return line(value, "s", "the same fit without nuisance parameters", plain)


def identification_times(model: str) -> tuple[float, float]:
    """Return seconds of a fit of eight parameters, with all nuisance parameters and without, after one that
    compiles."""
    patch = ContactPatch.disc(0.01, cells=21)
    law = LuGre(0.5, 0.65, 2e-3, 2e4, 30.0, 0.8, 1.4, ElastoPlastic(0.9))
    contact = (DistributedModel if model == "distributed" else ReducedModelPublished)(patch.compressed(), law)
    log = _log(contact, DURATION)
    identify_lugre(_log(contact, 0.1), patch, model=model, options=FitOptions(starts=1))
    times = []
    for nuisance in (("delay", "bias", "load", "twist"), ()):
        begin = time.perf_counter()
        identify_lugre(log, patch, model=model, options=FitOptions(nuisance=nuisance))
        times.append(time.perf_counter() - begin)
    return times[0], times[1]


def _log(contact: DistributedModel | ReducedModelPublished, duration: float) -> Log:
    t = np.arange(round(duration * RATE)) / RATE
    grown = np.minimum(1.0, 1.2 * np.exp(3.5 * (t / t[-1] - 1.0)))[:, None]
    twist = grown * [0.03, 0.02, 2.0] * np.sin(2.0 * np.pi * t[:, None] * [2.3, 1.7, 3.1])
    wrench = np.vstack([np.zeros(3), rollout(contact, None, 0.5 * (twist[1:] + twist[:-1]), LOAD, 1.0 / RATE).wrenches])
    noise = SHARE * np.sqrt(np.mean(wrench**2, axis=0)) * np.random.default_rng(0).standard_normal(wrench.shape)
    return Log(t, twist, wrench + noise, np.array(LOAD))
