"""A gripper in MuJoCo whose fingers hang on four-bar linkages, which equality constraints close."""

from __future__ import annotations

from planarfriction_studies.bench.mujoco_scenes import MujocoScene, grip

TORQUE = 0.5
"""Torque of the motor of each finger [N m]."""

_FINGER = """<body pos="{out}0.045 0.012 0.58">
    <joint name="{side}" axis="0 {turn} 0" damping="0.02" armature="1e-4"/><geom {bar} fromto="0 0 0 0 0 -0.05"/>
    <body pos="0 0 -0.05"><joint axis="0 {turn} 0" damping="0.002"/><geom {bar} fromto="0 0 0 {out}0.02 0 0"/>
    <site name="joint {side}" pos="{out}0.02 0 0"/><geom name="pad {side}" pos="{back}0.03 0 -0.03" {pad}/></body>
    </body>
    <body pos="{out}0.065 0.012 0.58"><joint axis="0 {turn} 0" damping="0.002"/><geom {bar} fromto="0 0 0 0 0 -0.05"/>
    <site name="end {side}" pos="0 0 -0.05"/></body>"""
"""Driven link, finger with its pad, and the second link, whose end is connected to the finger."""

_BAR = 'type="capsule" size="0.003" mass="0.02" contype="0" conaffinity="0"'
_PAD = (
    'type="box" size="0.005 0.008862 0.008862" mass="0.03" contype="1" conaffinity="0"'
)


def linkage() -> MujocoScene:
    """Build a block of 0.2 kg that two fingers on four-bar linkages hold 12 mm beside its centre of mass for 10 s."""
    sides = (("left", "-", "", -1), ("right", "", "-", 1))
    fingers = "".join(
        _FINGER.format(side=side, out=out, back=back, turn=turn, bar=_BAR, pad=_PAD)
        for side, out, back, turn in sides
    )
    loops = "".join(
        f'<connect site1="end {side}" site2="joint {side}" solref="0.004 1"/>'
        for side, *_ in sides
    )
    motors = "".join(f'<motor joint="{side}"/>' for side, *_ in sides)
    held = grip("box")
    block = """<geom name="block" type="box" size="0.01 0.04 0.06" mass="0.2" contype="0" conaffinity="1"/>
    <site name="left" pos="-0.01 0.012 0" zaxis="1 0 0"/><site name="right" pos="0.01 0.012 0" zaxis="-1 0 0"/>"""
    body = f"""<option><flag multiccd="disable"/></option><worldbody>{fingers}
    <body name="block" pos="0 0 0.5"><freejoint/>{block}</body></worldbody>
    <equality>{loops}</equality><actuator>{motors}</actuator>"""
    # Gravity begins after the settling time, and the fingers yield to it.
    return MujocoScene(
        body,
        held.mu,
        held.torsion,
        held.patches,
        held.model,
        lambda t: (TORQUE, TORQUE),
        time=10.0,
    )
