"""A hand in MuJoCo holds a plate of unknown friction and weight with the least grip that is safe, and tilts.

`Hold` gets what sensors in a finger would say: force and torque with noise, and the place of the plate in steps of
0.008 mm at 120 Hz, all 20 ms late. It lets the plate slip by a fraction of a millimetre, so that it knows friction, and
then grips as firmly as the load needs. A published rule, which is told the true friction, holds the same plate. Run it:

    python examples/hold_in_mujoco.py
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

import mujoco
import numpy as np

import planarfriction as pf
from planarfriction.adapters.mujoco import Friction, PatchContact, prepare
from planarfriction.online import FrictionObserver, Hold, Measurement, Sensors
from planarfriction_studies.rig.baselines import hold_rule

DT, DELAY, END = (
    1e-3,
    20,
    5.0,
)  # time step [s], delay of the sensors [steps], duration [s]
MU, MASS, ARM, RADIUS = (
    0.8,
    0.2,
    0.008,
    0.012,
)  # [-], [kg], from the pads to the centre of mass, of the pads [m]
FIRST, MOST, RATE = (
    20.0,
    40.0,
    150.0,
)  # forces of a finger at first and at most [N], largest change [N/s]
TILT, TILTS, LASTS = (
    np.radians(45.0),
    3.0,
    0.5,
)  # of the hand [rad], when, and for how long [s]
LIFTED = 0.2  # time from which the controller chooses the grip [s]
LEARNT = 2.8  # time by which friction is known: grips are compared from then on [s]
SENSORS = Sensors()

SIDE = RADIUS / np.sqrt(
    2.0
)  # half the width of boxes with their corners on the rim [m]
FINGERS = "".join(
    f"""<body pos="{sign * 0.007} 0 0"><joint name="{side}" type="slide" axis="{-sign} 0 0" damping="20"/>
    <geom name="{side}" type="box" size="0.005 {SIDE} {SIDE}" mass="0.05"/>
    <site name="{side}" pos="{-sign * 0.005} 0 0" zaxis="{sign} 0 0"/></body>"""
    for side, sign in (("near", 1), ("far", -1))
)
HAND = f"""<mujoco><option timestep="{DT}" integrator="implicitfast"/>
<default><geom solref="0.004 1" solimp="0.99 0.99 0.001"/></default>
<worldbody><body name="hand"><joint name="tilt" axis="1 0 0" damping="1"/>
<inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>{FINGERS}</body>
<body name="plate"><freejoint/>
<geom name="plate" type="box" size="0.002 0.055 0.02" pos="0 {ARM} 0" mass="{MASS}"/></body>
</worldbody>
<actuator><motor joint="near"/><motor joint="far"/><position joint="tilt" kp="500" dampratio="1"/></actuator>
</mujoco>"""


def disc(mu: float) -> pf.ReducedModel:
    """Return the friction of a pad."""
    law = pf.LuGre(
        mu_c=mu,
        mu_s=1.05 * mu,
        v_s=2e-3,
        sigma_0=2e5,
        sigma_1=100.0,
        sigma_2=0.1,
        elasto_plastic=0.9,
    )
    return pf.ReducedModel(pf.ContactPatch.disc(RADIUS), law)


class Held(NamedTuple):
    """Slip of a plate while friction is found and after that, and the mean grip force after it."""

    first: float
    """[m]"""
    slip: float
    """[m]"""
    turn: float
    """In all [rad]."""
    grip: float
    """[N]"""


def hold(control: Callable[[Measurement], Any], seed: int = 0) -> Held:
    """Hold the plate with a controller: from a measurement to a grip force."""
    spec = mujoco.MjSpec.from_string(HAND)
    patches = [
        PatchContact(disc(MU), site=side, geoms=("plate", side))
        for side in ("near", "far")
    ]
    prepare(spec, patches)
    m = spec.compile()
    d, friction, random = (
        mujoco.MjData(m),
        Friction(m, patches),
        np.random.default_rng(seed),
    )
    noise = [SENSORS.force_noise, SENSORS.force_noise, SENSORS.torque_noise]
    unit = (
        SENSORS.quantum / SENSORS.slip_rate * np.array([1.0, 1.0, 1.0 / SENSORS.base])
    )  # of a counted place
    slip, counted, ticked, sent = (
        np.zeros(3),
        np.zeros(3),
        0,
        deque[Measurement](maxlen=DELAY + 1),
    )
    for k in range(100):  # an empty hand: the bias of its sensors
        control(
            Measurement(
                DT * (k - 200),
                random.normal(size=3) * noise,
                random.normal() * noise[0],
            )
        )
    grip, places, grips = FIRST, [], []
    for k in range(round(END / DT)):
        d.ctrl[:] = grip, grip, TILT * np.clip((k * DT - TILTS) / LASTS, 0.0, 1.0)
        friction.step(d)
        slip = (
            slip - DT * friction.twists(d)[0]
        )  # of the plate over the near finger, whose site has the patch's axes
        velocity = np.full(3, np.nan)
        if int((k + 1) * DT * SENSORS.slip_rate) > int(k * DT * SENSORS.slip_rate):
            now = np.rint(slip / unit)
            velocity, counted, ticked = (
                (now - counted) * unit / ((k - ticked) * DT),
                now,
                k,
            )
        wrench = -friction.wrenches(d)[0] + random.normal(size=3) * noise
        sent.append(
            Measurement(
                k * DT,
                wrench,
                friction.loads(d)[0] + random.normal() * noise[0],
                velocity,
            )
        )
        wanted = (
            min(float(np.asarray(control(sent[0]))), MOST) if k * DT > LIFTED else FIRST
        )
        grip += np.clip(wanted - grip, -RATE * DT, RATE * DT)
        places.append(slip.copy())
        grips.append(grip)
    path, known = np.array(places), round(LEARNT / DT)
    slips = [
        np.hypot(*(part - part[0])[:, :2].T).max()
        for part in (path[:known], path[known:])
    ]
    return Held(*slips, abs(path[:, 2]).max(), float(np.mean(grips[known:])))


class Rule:
    """Published rule, with the true friction."""

    def __init__(self) -> None:
        self.grip, self.speed, self.radius = (
            FIRST,
            0.0,
            pf.ContactPatch.disc(RADIUS).contact_radius(),
        )

    def __call__(self, sample: Measurement) -> float:
        """Return the grip force of a sample."""
        if sample.slip_velocity is not None and np.isfinite(sample.slip_velocity).all():
            self.speed = float(np.hypot(*sample.slip_velocity[:2]))
        self.grip = float(
            hold_rule(sample.wrench, self.speed, self.radius, MU, self.grip)
        )
        return self.grip


def main() -> dict[str, Held]:
    """Hold the plate in both ways, and print what happened."""
    found = {
        "Hold": hold(Hold(FrictionObserver(disc(0.5), sensors=SENSORS)).update),
        "published rule": hold(Rule()),
    }
    for name, each in found.items():
        slips = f"{1e3 * each.first:.2f} mm at first, {1e3 * each.slip:.2f} mm later"
        print(
            f"{name}: {each.grip:.1f} N, slips {slips}, turns {np.degrees(each.turn):.1f} degrees"
        )
    return found


if __name__ == "__main__":
    main()
