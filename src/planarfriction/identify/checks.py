"""Checks of logs and slides before they are fitted: each finding is one line on what is odd, and what it may mean."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from planarfriction.errors import InvalidValueError
from planarfriction.geometry import rotate
from planarfriction.identify.logs import Log
from planarfriction.identify.result import Identification
from planarfriction.identify.slides import MassProperties, Slide, window_twists
from planarfriction.identify.verdicts import Verdict
from planarfriction.patch import ContactPatch

FAST = 0.2
"""Share of the usual largest speed from which a sample counts as sliding: bristles that
load or turn are slower, and less than that is noise."""

STRONG = 0.2
"""Share of the usual largest wrench from which a sample counts as under load."""

LEAST = 20
"""Least number of sliding samples that a check needs."""

MOST = 120
"""Largest number of sliding samples that a check takes, evenly chosen."""

MOST_CELLS = 500
"""Number of cells of a patch above which a check uses discs."""

FEW_DISCS = 100
"""Number of discs that a check uses in place of many cells."""

AGAINST = 0.7
"""Largest share of the work with which friction may drive the motion: bristles give some work back."""

MISREAD = 5.0
"""Median angle between the wrench and that of sliding friction [deg] from which a log
may have been misread."""

BETTER = 0.4
"""Largest angle of another reading over the angle as read, if that reading is to be named: no reading lowers noise."""

NEAR = np.geomspace(1.0 / 3.0, 3.0, 9)
"""Factors on the estimated size of a patch that count as the same patch."""

FAR = np.concatenate([np.geomspace(1e-4, 0.25, 28), np.geomspace(4.0, 1e4, 28)])
"""Factors on the estimated size of a patch that count as another one."""

LEVERS = {
    1e-3: "the patch in mm",
    0.13: "omega in deg/s",
    10.0: "vx and vy in cm/s",
    32.0: "vx and vy in mm/s, or tau in N mm",
    1e3: "all lengths in mm but those of the patch",
}
"""Factors on the contact radius that a wrong unit explains; a factor shows as the root of `tau v/(f omega)`."""

SAME_LEVER = 2.0
"""Largest ratio of a factor on the contact radius to one of `LEVERS` that it is put down to."""

HIGH = 4.0
"""Friction over load above which one of both has another unit or another scale."""

TRAVEL = 0.1
"""Displacement between two samples that is long for slow sampling, as a share of the
contact radius."""

SLOW = 0.2
"""Time between two samples that is long [s]."""

SPEEDY = 10.0
"""Speed [m/s] that is more likely one in mm/s."""

LEAST_MOUNTED = np.radians(20.0)
"""Angle between the axes of force and motion [rad] that no anisotropy and no
calibration explains."""

LEAST_TURN = 0.5
"""Turn of the contact [rad] below which axes of the world and of the contact are the
same."""


LOW = 1e-4
"""Friction over load of a slide below which its times are too large: the least of solids is some 1e-3."""

VARIES = 0.1
"""Spread of the logarithm of friction in slides from which angles may be misread;
measured slides have 0.07."""

STEADIER = 0.3
"""Largest spread of friction in slides if angles are read as degrees, over the spread as read, if they are degrees."""

SURE = 0.3
"""Spread of the logarithm of friction from which on no other cause is left than misread
angles."""

FEW = 4
"""Number of decelerations from which on their spread is judged."""

USUAL = 1.0
"""Friction over load of a slide above which angles may be misread."""

HALF = 0.5
"""Largest friction of slides whose angles are read as degrees, over the friction as read, if they are misread."""

STILL = 2
"""Number of steps in a row without motion that show a frozen tracker."""

SLOWED = 0.1
"""Largest speed of a frozen tracker, over the speed after the jump that ends the freeze."""

JUMP = 2.0
"""Least speed of the jump after a freeze, over the speed after the jump."""


class Finding(NamedTuple):
    """Property of a log that does not look as it should."""

    name: str
    """Name of the quantity, such as "wrench of log"."""
    rule: str
    """Rule that it should follow, continuing "<name> should ..."."""
    found: str
    """Value that was found, and its likely cause."""
    refuses: bool = False
    """True if no fit can make sense of it."""

    def __str__(self) -> str:
        return f"{self.name} should {self.rule}, got {self.found}"


def check_logs(logs: Sequence[Log], patch: ContactPatch) -> tuple[Finding, ...]:
    """Check logs of a contact on `patch`; returns what is odd about them.

    Raises InvalidValueError, one line, for what no fit can make sense of.
    """
    return _accepted(finding for log in logs for finding in check_log(log, patch))


def check_slides(
    slides: Sequence[Slide], patch: ContactPatch, body: MassProperties
) -> tuple[Finding, ...]:
    """Check slides of a body on `patch`: units of time, places and angles, and trackers that froze.

    Raises InvalidValueError, one line, for what no fit can make sense of.
    """
    found = (check_slide_units(slides, patch, body), *map(check_frozen, slides))
    return _accepted(filter(None, found))


def _accepted(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    findings = tuple(findings)
    for finding in findings:
        if finding.refuses:
            raise InvalidValueError(finding.name, finding.rule, finding.found)
    return findings


def with_findings(
    result: Identification, logs: Sequence[Log], findings: Sequence[Finding]
) -> Identification:
    """Return the result with verdicts on the findings, and on the sampling rate that its estimates ask for."""
    odd = [*findings]
    verdicts = []
    estimates = result.estimates
    # where sigma_1 may be 0, or nobody knows it, its corner may lie anywhere
    low, _ = result.intervals().get("sigma_1", (0.0, 0.0))
    if "sigma_0" in estimates and low > 0.0:
        rates = [
            check_sampling(log, estimates["sigma_0"], estimates["sigma_1"])
            for log in logs
        ]
        odd += filter(None, rates)
        if None not in rates:
            verdicts.append(
                Verdict(
                    "sigma_1",
                    False,
                    "no log is sampled at twice the corner frequency of the bristles",
                )
            )
    verdicts += (Verdict("fit", False, str(finding)) for finding in odd)
    return dataclasses.replace(result, verdicts=(*result.verdicts, *verdicts))


def check_log(log: Log, patch: ContactPatch) -> list[Finding]:
    """Check one log: sign of the work, axes and units, displacement between samples, friction against load."""
    size = size_at(load_of(log), patch)
    sliding = Sliding.of(log, patch, size)
    found = (
        check_work(log, sliding) or check_directions(log, sliding, size),
        check_times(log, size),
        check_friction(log, size),
        check_unloaded(log, size),
    )
    return [*filter(None, found)]


# ---------------------------------------------------------------------- work and direction


class Sliding(NamedTuple):
    """Samples of a log that slide, S of them, and the N cells of its patch."""

    twist: np.ndarray
    """Twists [m/s, m/s, rad/s], `[S, 3]`."""
    wrench: np.ndarray
    """Wrenches [N, N, N m], `[S, 3]`."""
    turned: np.ndarray
    """Angle since the begin of the log [rad], `[S]`."""
    levers: np.ndarray
    """Velocities of the cells per twist, `[N, 2 or 3, 3]` (see `ContactPatch.levers`)."""
    weights: np.ndarray
    """Shares of the load [-], `[N]`."""
    channels: np.ndarray
    """Mask of the measured channels, `[3]`."""

    @classmethod
    def of(cls, log: Log, patch: ContactPatch, radius: float) -> Sliding:
        """Select the fast samples under load, at most `MOST` of them."""
        few = patch.discs(FEW_DISCS) if patch.cells > MOST_CELLS else patch
        size = [1.0, 1.0, radius]
        speed = np.linalg.norm(log.twist * size, axis=1)
        force = np.linalg.norm(log.wrench / size, axis=1)
        fast = speed >= FAST * np.quantile(speed, 0.95)
        strong = force >= STRONG * np.quantile(force, 0.95)
        loaded = (speed > 0.0) & (force > 0.0) & (log.normal_force > 0.0)
        rows = np.flatnonzero(fast & strong & loaded)
        rows = rows[:: max(1, -(-len(rows) // MOST))]
        spin = log.twist[:, 2]
        since = spin[1:] if log.held else spin[:-1]
        turns = 0.5 * (spin[1:] + since) * np.diff(log.time)
        return cls(
            log.twist[rows],
            log.wrench[rows],
            np.append(0.0, np.cumsum(turns))[rows],
            few.levers(),
            few.weights(load_of(log)),
            log.channels,
        )

    def friction(self, twist: np.ndarray, scale: float) -> np.ndarray:
        """Compute wrenches `[S, 3]` of dry friction under a load of 1 at the twists, on the patch times `scale`."""
        levers = self.levers * [1.0, 1.0, scale]
        velocities = twist @ levers.transpose(1, 2, 0)
        speed = np.linalg.norm(velocities, axis=0)
        tractions = velocities * (-self.weights / np.where(speed > 0.0, speed, 1.0))
        return np.einsum("isn,nij->sj", tractions, levers, optimize=True)

    def angle(self, twist: np.ndarray, wrench: np.ndarray, scale: float) -> float:
        """Compute the median angle [deg] between wrenches and those of dry friction."""
        size = np.sqrt((self.weights @ self.levers[:, :, 2] ** 2).sum())
        a, b = (
            (each / [1.0, 1.0, size])[:, self.channels]
            for each in (self.friction(twist, scale), wrench)
        )
        lengths = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
        cosines = (a * b).sum(axis=1) / np.where(lengths > 0.0, lengths, 1.0)
        return np.degrees(np.median(np.arccos(np.clip(cosines, -1.0, 1.0))))

    def best(
        self, twist: np.ndarray, wrench: np.ndarray, scales: np.ndarray = NEAR
    ) -> tuple[float, float]:
        """Return the least median angle [deg] over sizes of the patch, and the size that has it."""
        return min((self.angle(twist, wrench, scale), scale) for scale in scales)


def check_work(log: Log, sliding: Sliding) -> Finding | None:
    """Check that friction takes work from the moving body; a wrench that gives work has the wrong sign."""
    power = (sliding.twist * sliding.wrench).sum(axis=1)
    driving = power > 0.0
    if len(power) < LEAST or power[driving].sum() <= AGAINST * np.abs(power).sum():
        return None
    rule = f"act on the moving body, against its motion (it does {_best_reading(sliding)[1]})"
    return Finding(
        f"wrench of {log.name}",
        rule,
        f"power > 0 in {100.0 * driving.mean():.4g} % of the samples that slide",
        refuses=True,
    )


def check_directions(log: Log, sliding: Sliding, size: float) -> Finding | None:
    """Check that the wrench points against the sliding as the patch says, or name a reading that fits far better."""
    if len(sliding.twist) < LEAST:
        return None
    as_read = sliding.best(sliding.twist, sliding.wrench)[0]
    if as_read < MISREAD:
        return None
    angle, words = _best_reading(sliding)
    on_another, scale = sliding.best(sliding.twist, sliding.wrench, FAR)
    if on_another < angle:
        angle = on_another
        factor = min(LEVERS, key=lambda each: abs(np.log(scale / each)))
        words = f"with a contact radius of {1e3 * scale * size:.3g} mm in place of {1e3 * size:.3g} mm"
        if 1.0 / SAME_LEVER < scale / factor < SAME_LEVER:
            words += f" ({LEVERS[factor]}?)"
    if angle > BETTER * as_read:
        return None
    rule = "point in the direction of friction on the patch"
    return Finding(
        f"wrench of {log.name}",
        rule,
        f"a median deviation of {as_read:.0f} deg, and {angle:.0f} deg {words}",
    )


def _best_reading(sliding: Sliding) -> tuple[float, str]:
    """Return the angle [deg] of the reading of the log that best has the directions of friction, and words for it."""
    return min(
        (sliding.best(twist, wrench)[0], words)
        for words, twist, wrench in _readings(sliding)
    )


def _readings(sliding: Sliding) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Yield ways in which a log may have been written: words, and the twist and wrench that follow."""
    twist = sliding.twist
    wrench = sliding.wrench
    turned = sliding.turned
    for words, signs in (
        ("with fx, fy and tau of opposite sign", (-1, -1, -1)),
        ("with fx and fy of opposite sign", (-1, -1, 1)),
        ("with tau of opposite sign", (1, 1, -1)),
        ("with fx of opposite sign", (-1, 1, 1)),
        ("with fy of opposite sign", (1, -1, 1)),
        ("with fy and tau of opposite sign, as if z points down", (1, -1, -1)),
        ("with fx and tau of opposite sign, as if z points down", (-1, 1, -1)),
    ):
        yield words, twist, wrench * signs
    if np.ptp(turned) > LEAST_TURN:
        yield "if the twist is in world axes", rotate(twist, -turned), wrench
        yield "if the wrench is in world axes", twist, rotate(wrench, -turned)
    for scale in NEAR[::4]:
        expected = sliding.friction(twist, scale)[:, :2] @ [1.0, 1.0j]
        angle = np.angle((wrench[:, :2] @ [1.0, 1.0j]).conj() @ expected)
        if abs(angle) > LEAST_MOUNTED:
            words = f"with fx and fy rotated by {np.degrees(angle):.0f} deg"
            yield words, twist, rotate(wrench, angle)


# ---------------------------------------------------------------------- times, speeds, loads


def check_times(log: Log, size: float) -> Finding | None:
    """Check that the contact moves a small part of its size between two samples; more points to mm/s, or to ms."""
    speed = np.quantile(np.linalg.norm(log.twist * [1, 1, size], axis=1), 0.9)
    moved = speed * log.interval
    seen = f"{1e3 * moved:.3g} mm between samples {log.interval:.3g} s apart, contact radius {1e3 * size:.3g} mm"
    if log.interval >= SLOW and moved > TRAVEL * size:
        return Finding(f"t of {log.name}", "be in s", f"{seen}: is it in ms?")
    if speed > SPEEDY or moved > size:
        return Finding(
            f"twist of {log.name}",
            "be in m/s and rad/s",
            f"{seen}: are vx and vy in mm/s, or omega in deg/s?",
        )
    return None


def check_friction(log: Log, size: float) -> Finding | None:
    """Check that friction is not many times the load, as it is if one of both has another unit."""
    loaded = log.normal_force > 0.0
    if not loaded.any():
        return None
    shares = log.wrench[loaded] / log.normal_force[loaded, None]
    force = np.quantile(np.linalg.norm(shares[:, :2], axis=1), 0.9)
    torque = np.quantile(np.abs(shares[:, 2]) / size, 0.9)
    if force > HIGH:
        return Finding(
            f"normal_force of {log.name}",
            "be in N",
            f"friction of {force:.3g} times the load: is normal_force in kg or kN?",
        )
    if torque > HIGH:
        rule = "be in N m about the origin of the contact frame"
        text = f"a torque of {torque:.3g} times the load and the contact radius: is it in N mm, or about another point?"
        return Finding(f"tau of {log.name}", rule, text)
    return None


def check_unloaded(log: Log, size: float) -> Finding | None:
    """Check that there is no friction without load, as there is with a load cell that has an offset."""
    force = np.linalg.norm(log.wrench / [1.0, 1.0, size], axis=1)
    bare = force[log.normal_force == 0.0]
    if len(bare) < LEAST or np.median(bare) <= STRONG * np.quantile(force, 0.95):
        return None
    rule = f"be > 0 where there is friction (it is 0 in {len(bare)} samples)"
    text = (
        f"friction of {np.median(bare):.3g} N there: does the load cell have an offset?"
    )
    return Finding(f"normal_force of {log.name}", rule, text)


def check_sampling(log: Log, sigma_0: float, sigma_1: float) -> Finding | None:
    """Check that samples reach the corner `sigma_0/(2 pi sigma_1)` above which the damping of bristles shows."""
    if not (sigma_0 > 0.0 and sigma_1 > 0.0):
        return None
    corner = sigma_0 / (2.0 * np.pi * sigma_1)
    rate = 1.0 / log.interval
    if rate >= 2.0 * corner:
        return None
    why = f"to determine sigma_1 (corner frequency sigma_0/(2 pi sigma_1): {corner:.3g} Hz)"
    return Finding(
        f"samples of {log.name}",
        f"be taken at {2.0 * corner:.3g} Hz or more {why}",
        f"{rate:.3g} Hz",
    )


# ---------------------------------------------------------------------- slides


def check_slide_units(
    slides: Sequence[Slide], patch: ContactPatch, body: MassProperties
) -> Finding | None:
    """Check that decelerations are those of friction, and alike in all windows of all slides, for times in s, places in
    m and angles in rad: of 281 measured slides, one at a time, 245 are doubted if they are in deg, and none in rad."""
    size = size_at(body.mass * body.gravity, patch)
    as_read = _friction_of_slides(slides, body, size, 1.0)
    if len(as_read) == 0:
        return None
    in_degrees = _friction_of_slides(slides, body, size, np.pi / 180.0)
    friction = np.median(as_read)
    less = np.median(in_degrees)
    spread = np.std(np.log(as_read))
    steadier = np.std(np.log(in_degrees))
    text = f"friction of {friction:.3g} times the load"
    if friction < LOW:
        return Finding(
            "time of the slides", "be in s", f"{text}: is it in ms?", refuses=True
        )
    if (spread > VARIES and steadier < STEADIER * spread) or (
        friction > USUAL and less < HALF * friction
    ):
        text = f"friction over load {friction:.3g} ± {100 * spread:.0f} %"
        text += f", but {less:.3g} ± {100 * steadier:.0f} % if it is in deg"
        sure = (len(as_read) >= FEW and spread > SURE) or friction > HIGH
        return Finding("theta of the slides", "be in rad", text, refuses=bool(sure))
    if friction > HIGH:
        return Finding(
            "x and y of the slides", "be in m", f"{text}: are they in mm?", refuses=True
        )
    return None


def _friction_of_slides(
    slides: Sequence[Slide], body: MassProperties, size: float, unit: float
) -> np.ndarray:
    """Compute friction over load, `|(a, I alpha/(m size))|/g` > 0, between windows of moving slides."""
    found = []
    for slide in slides:
        times, twists, _ = window_twists(slide)
        speed = np.hypot(twists[:, 0], twists[:, 1])
        scale = [1.0, 1.0, unit * body.inertia / (body.mass * size)]
        rates = np.diff(twists * scale, axis=0) / np.diff(times)[:, None]
        moving = np.minimum(speed[:-1], speed[1:]) > FAST * speed.max()
        found.append(np.linalg.norm(rates[moving], axis=1) / body.gravity)
    friction = np.concatenate(found)
    return friction[friction > 0.0]


def check_frozen(slide: Slide) -> Finding | None:
    """Check that a tracked body does not stand still and then jump, as it does where a tracker froze."""
    steps = np.hypot(*np.diff(slide.pose[:, :2], axis=0).T)
    speed = steps / np.diff(slide.time)
    for k in range(STILL, len(speed) - 3):
        after = np.median(speed[k + 1 : k + 4])
        if speed[k - STILL : k].max() < SLOWED * after and speed[k] > JUMP * after:
            moving = np.flatnonzero(speed[:k] >= SLOWED * after) + 1
            rest = slide.time[k] - slide.time[moving.max(initial=0)]
            rule = "follow the body (leave out frozen samples)"
            text = f"no motion for {1e3 * rest:.3g} ms until t = {slide.time[k]:.4g} s"
            text += f", then a jump of {1e3 * steps[k]:.3g} mm"
            return Finding(f"pose of {slide.name}", rule, text, refuses=True)
    return None


def load_of(log: Log) -> float:
    """Return the median load of the samples under load [N], 1 without any."""
    loaded = log.normal_force[log.normal_force > 0.0]
    return np.median(loaded) if len(loaded) else 1.0


def size_at(load: float, patch: ContactPatch) -> float:
    """Return the length that turns spin into speed [m]: the contact radius at a load.

    Raises InvalidValueError for a single point.
    """
    size = patch.contact_radius(load)
    if not size > 0.0:
        rule = "be wider than a point for an identification (a disc of 0.1 mm has the friction of a point)"
        raise InvalidValueError(
            "patch", rule, f"{patch.cells} cell with a contact radius of {size:g} m"
        )
    return size
