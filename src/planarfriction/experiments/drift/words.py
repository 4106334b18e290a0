"""What the drift experiment says of its numbers."""

from __future__ import annotations

from typing import Any

from planarfriction.experiments.drift.figures import WORDS
from planarfriction.experiments.experiment import Table


def findings(numbers: dict[str, Any]) -> list[str]:
    """Paragraphs from the numbers of this run."""
    return [_creep(numbers["creep"]), _deflections(numbers), _causes(numbers), _small_print(numbers)]


def creep_table(numbers: dict[str, Any]) -> Table:
    """Drift per period of the load, by what oscillates."""
    rows: list[list[str | float]] = []
    for what, models in numbers["creep"].items():
        for model, moved in models.items():
            shown = [float(f"{factor * moved[name]:.4g}") for name, factor in (("x", 1e9), ("theta", 1e6))]
            rows.append([f"{what}; {WORDS[model]}", *shown])
    return Table("Drift per period of 1/3 s", ["what oscillates; model", "x [nm]", "theta [µrad]"], rows)


def _creep(creep: dict[str, Any]) -> str:
    force, both, normal = (creep[what] for what in ("force", "force and torque", "normal force"))
    return (
        "A disc of 1 kg is pushed by less than friction holds. With plain bristles it creeps: by "
        f"{1e9 * force['d']['x']:.3g} nm a period under the oscillating force (reduced model: "
        f"{1e9 * force['r']['x']:.3g} nm), by {_moved(both['d'])} "
        f"once a torque oscillates too (reduced: {_moved(both['r'])}), and by {_moved(normal['d'])} under the "
        f"oscillating normal force (reduced: {_moved(normal['r'])}). With elasto-plastic bristles the distributed "
        f"model does not: {_largest(creep, 'd_ep', 'x'):.1g} m and {_largest(creep, 'd_ep', 'theta'):.1g} rad a period "
        "at most, which is rounding."
    )


def _moved(drift: dict[str, float]) -> str:
    return f"{1e9 * drift['x']:.3g} nm and {1e6 * drift['theta']:.3g} µrad"


def _largest(creep: dict[str, Any], model: str, name: str) -> float:
    return max(abs(models[model][name]) for models in creep.values())


def _deflections(numbers: dict[str, Any]) -> str:
    measured = numbers["plateaus"]["measured"]
    true, table, ellipsoid = (measured[model] for model in ("d_ep", "r_ep", "e_ep"))
    return (
        "Where force and torque are held together, at 1 s of the normal-load run, the distributed model's bristles "
        f"bend as springs do: x = F/(sigma_0 f_N) = {1e9 * true['x']:.4f} nm, theta = tau/(sigma_0 f_N <rho^2>) = "
        f"{1e6 * true['theta']:.5f} µrad. Those of the published reduced model bend by {1e9 * table['x']:.2f} nm "
        f"({_percent(table, true, 'x')}) and {1e6 * table['theta']:.3f} µrad ({_percent(table, true, 'theta')}). With "
        f"the ellipsoid in the table's place x is {_percent(ellipsoid, true, 'x')}, and theta "
        f"{_percent(ellipsoid, true, 'theta')}."
    )


def _percent(found: dict[str, float], true: dict[str, float], name: str) -> str:
    share = 100.0 * (found[name] / true[name] - 1.0)
    return "exact" if abs(share) < 1e-3 else f"{share:+.1f} %"


def _causes(numbers: dict[str, Any]) -> str:
    patch, measured = numbers["patch"], numbers["plateaus"]["measured"]["straight"]
    closed, creep = numbers["plateaus"]["closed form"]["straight"], numbers["creep"]["normal force"]
    table, ellipsoid = (
        100.0 * (1.0 - patch[f"contact radius of the {which}"] ** 2 / patch["second moment"])
        for which in ("table", "ellipsoid")
    )
    return (
        "There are two causes. The torsional stiffness of the three bristles is sigma_0 r^2, not sigma_0 <rho^2>: "
        f"{ellipsoid:.1f} % too low with the ellipsoid's r, which is all of its difference, and {table:.1f} % with the "
        "table's. And while nothing slides the bristles still move at h(V) |V_S|, where it should be V_S itself: h is "
        "the direction of a sliding wrench, shorter than 1 and turned away from V_S unless the motion is a pure slide "
        "or spin. So the deflection does not even follow from the load, but from its path. Along a straight one it is "
        f"the twist whose h is parallel to the load, {1e9 * closed['x']:.2f} nm and {1e6 * closed['theta']:.3f} µrad "
        f"(a slow ramp without steps: {1e9 * measured['x']:.2f} nm and {1e6 * measured['theta']:.3f} µrad); in steps "
        "of 0.01 s, after each of which x and theta settle at their own pace, it is the one above. The table model "
        "even creeps a little under the oscillating normal force with elasto-plastic bristles, "
        f"{1e12 * creep['r_ep']['x']:.2g} pm and {1e9 * creep['r_ep']['theta']:.2g} nrad a period, {_share(creep):.1g} "
        f"of the plain model's drift, where the ellipsoid stays within {abs(creep['e_ep']['x']):.0e} m."
    )


def _share(creep: dict[str, Any]) -> float:
    return max(abs(creep["r_ep"][name] / creep["r"][name]) for name in ("x", "theta"))


def _small_print(numbers: dict[str, Any]) -> str:
    return (
        "The article gives the patch a radius of 0.05 m; the published angles are those of a patch that is "
        f"{numbers['implied width']:.5f} m wide, which is what is computed here (twice the width would turn a quarter "
        f"as far). The disc also moves sideways, by up to {1e12 * numbers['sideways']:.2g} pm: its patch stays on the "
        "table, and a disc that is pushed aside by x and turns about the patch moves by int x dtheta. In the published "
        "runs y is zero, as for a patch that goes with the disc."
    )
