"""The physics, once: every formula as `f(xp, ...)` for scalars and for tensors.

`xp` is the namespace that supplies `exp`, `expm1`, `log`, `sin`, `cos`, `power`, `where`, `minimum` and `maximum`:
NumPy, torch and jax.numpy pass themselves, compiled loops pass `compiled_math` of the engine's compiler. A formula is
assignments and one return; it has no loop and no branch, and chooses what to divide rather than whether to: of that,
compilers make a branch, and processors do not foresee it. Symbols as in Waltersson and Karayiannidis 2024, sections III
and IV; each formula names the section of docs/physics.md, or the page of docs, where it stands and comes from.

A bristle is a vector `z` driven by a velocity `u`, of any dimension: two for a cell of the distributed model
(`u = v`), three for the published reduced model (`u = h(V) v_n`). The formulas see only norms and projections:

- `z_norm = |z|`, `speed`, `along = z/|z| . u/|u| speed` (the speed at which the bristle is being stretched).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

LARGEST = 1e50
"""Largest number of any quantity in SI units: beyond all that exists, and products of six stay finite."""

LIGHTEST = 1e-12
"""Share of its reference load below which the stiffness of a law that has one falls with the load again."""


class LawNumbers(NamedTuple):
    """Numbers of a friction law that the formulas read by name: floats, or arrays that broadcast with the bristles."""

    sigma_0: Any
    """Bristle stiffness per unit normal load [1/m]."""
    sigma_1: Any
    """Bristle damping per unit normal load [s/m]."""
    sigma_2: Any
    """Viscous friction per unit normal load [s/m]."""
    mu_c: Any
    """Coulomb coefficient [-]."""
    mu_s: Any
    """Static coefficient [-]."""
    v_s: Any
    """Stribeck speed [m/s]."""
    gamma: Any
    """Stribeck exponent [-]."""
    elasto_plastic: Any = 0.0
    """1.0 for elasto-plastic bristles, else 0.0."""
    breakaway_ratio: Any = 0.5
    """s_ba [-]; unused by plain bristles, but 1 - s_ba is divided by."""
    creep_speed: Any = 0.0
    """v_c [m/s]: plain bristles relax as if they slid faster by this speed; 0 keeps what sticks where it is."""


PARAMETERS = (
    *("sigma_0", "sigma_1", "sigma_2", "mu_c", "mu_s", "v_s", "breakaway_ratio"),
    *("scale", "centre_x", "centre_y"),
)
"""Numbers of a patch that may differ between environments: of its law, its size, and its displacement [m]."""


def stribeck(xp: Any, speed: Any, law: Any) -> Any:
    """Friction coefficient in steady sliding, `g = mu_c + (mu_s - mu_c) exp(-|v/v_s|^gamma)` [-] ("Bristles")."""
    return stribeck_at(xp.exp(-stribeck_power(xp, speed, law)), law)


def stribeck_power(xp: Any, speed: Any, law: Any) -> Any:
    """`|v/v_s|^gamma` [-]."""
    return xp.power(speed * (1.0 / law.v_s), law.gamma)


def stribeck_at(effect: Any, law: Any) -> Any:
    """`stribeck` at a known effect `exp(-|v/v_s|^gamma)`."""
    return law.mu_c + (law.mu_s - law.mu_c) * effect


def slip_fraction(xp: Any, deflection: Any, breakaway_ratio: Any) -> Any:
    """Elasto-plastic `alpha` [-] of the relative deflection `|z|/z_max`: 0 below breakaway, 1 at full deflection.

    `1/2 + 1/2 sin(pi (share - 1/2)) = sin^2(pi share/2)` of the share of the way from breakaway to full deflection: in
    this form exactly zero below breakaway, so that rounding cannot creep. ("Bristles")
    """
    share = (deflection - breakaway_ratio) * (1.0 / (1.0 - breakaway_ratio))
    root = xp.sin(0.5 * math.pi * xp.minimum(xp.maximum(share, 0.0), 1.0))
    return root * root


def slip_fraction_slope(xp: Any, deflection: Any, breakaway_ratio: Any) -> Any:
    """Derivative of `alpha` with respect to `|z|/z_max` [-]."""
    per_width = 1.0 / (1.0 - breakaway_ratio)
    phase = (deflection - 0.5 * (1.0 + breakaway_ratio)) * per_width
    return (
        0.5
        * math.pi
        * per_width
        * xp.cos(math.pi * xp.minimum(xp.maximum(phase, -0.5), 0.5))
    )


def bristle_decay(
    xp: Any, deflection: Any, along: Any, speed: Any, grip: Any, law: Any
) -> Any:
    """Rate `k = beta |v| sigma_0 / g` [1/s] of `zdot = u - k z`.

    `beta |v| = alpha (|v| + z.v/|z|) / 2` for elasto-plastic bristles, `|v| + v_c` for plain ones (LuGre: v_c = 0);
    `deflection = |z|/z_max`, `grip = sigma_0 / g` [1/m]. ("Bristles")
    """
    return decay_at(
        xp, slip_fraction(xp, deflection, law.breakaway_ratio), along, speed, grip, law
    )


def decay_at(xp: Any, alpha: Any, along: Any, speed: Any, grip: Any, law: Any) -> Any:
    """`bristle_decay` at a known `alpha`."""
    # Rounding below zero would let a long step grow without bound.
    closing = xp.maximum(speed + along, 0.0)
    return (
        xp.where(
            law.elasto_plastic > 0.0, 0.5 * alpha * closing, speed + law.creep_speed
        )
        * grip
    )


def traction(z: Any, zdot: Any, velocity: Any, law: Any) -> Any:
    """Friction per unit normal load on the moving body, `-(sigma_0 z + sigma_1 zdot + sigma_2 v)` ("Bristles")."""
    return -(law.sigma_0 * z + law.sigma_1 * zdot + law.sigma_2 * velocity)


def mean_decay(start: Any, end: Any, dt: Any) -> Any:
    """Mean of k over a step [1/s] from its values at the start and at the predicted end.

    Half and half for short steps (second order), all on the end for steps much longer than the bristle's memory,
    whose result is then the steady state of k at the end; the share of the start, `1/(2 + x + x^2)` of `x = k dt`,
    leads over. ("Step at constant twist")
    """
    x = 0.5 * (start + end) * dt
    return end + (start - end) / (2.0 + x + x * x)


def relaxation(xp: Any, decay_dt: Any) -> tuple[Any, Any]:
    """`exp(-x)` and `(1 - exp(-x))/x` of `x = k dt >= 0`: the exact step of `zdot = u - k z` for a held `k` and `u`.

    `z(dt) = exp(-x) z + (1 - exp(-x))/x u dt`. Plain LuGre has a constant k and this is its step. Elasto-plastic
    bristles take `mean_decay` of k at the start and at a predicted end, `z_p = (z + u dt)/(1 + k dt)`: second order,
    stable at any dt. Below `x = 1e-3` the quotient is its series, exact to 1e-16 there, where the difference would
    cancel. ("Step at constant twist")
    """
    # e^-300 is nothing beside 1, and products with less leave the range in which processors are fast
    remaining = xp.where(decay_dt < 300.0, xp.exp(xp.maximum(-decay_dt, -300.0)), 0.0)
    far = decay_dt > 1e-3
    series = 1.0 - decay_dt * (
        0.5
        - decay_dt * (1.0 / 6.0 - decay_dt * (1.0 / 24.0 - decay_dt * (1.0 / 120.0)))
    )
    return remaining, xp.where(far, 1.0 - remaining, series) / xp.where(
        far, decay_dt, 1.0
    )


def reachable_deflection(xp: Any, deflection: Any, law: Any) -> Any:
    """Largest `|z|/z_max` that a step may end with: an elasto-plastic bristle never grows past `max(|z|, z_max)`.

    The exact solution stays in that ball, so bringing a step back onto it cannot enlarge the error. Plain LuGre needs
    no bound: its step is exact. ("Step at constant twist")
    """
    return xp.where(law.elasto_plastic > 0.0, xp.maximum(deflection, 1.0), math.inf)


def cap(xp: Any, deflection: Any, largest: Any) -> Any:
    """Factor `min(1, largest/deflection)` that brings a bristle back onto the ball of that radius, direction kept."""
    over = deflection > largest
    return xp.where(over, largest, 1.0) / xp.where(over, deflection, 1.0)


# ---------------------------------------------------------------------- small discs

DISC_A = 1.41004444 - 12.0 / 7.0
"""Coefficient a of the mean speed of a disc, fitted to its elliptic integral (see
`disc_friction`)."""

DISC_B = 1.41004444
"""Coefficient b of the mean speed of a disc."""

DISC_C = 2.28646589
"""Coefficient c of the mean speed of a disc."""

UNEVEN = 1.2
"""Unevenness of the bristles inside a disc [-]: 1 for a rigid field, more takes off a small delay of slip."""

TURNED = 60.0
"""Growth of that unevenness where bristles have more spin than the motion, as after a reversal [-]."""

ACROSS_SPIN = 0.54
"""Share of its decay that a bristle across the sliding of a disc lacks in a pure spin [-]."""

ACROSS = 1.70
"""Coefficient of that share where a disc slides [-]: 1.71 is exact where it hardly spins."""

PLAIN_ACROSS = 0.5
"""Factor of both for plain bristles [-]."""

DISC_REST = 1e-37
"""Fourth power of a speed, 0.6 nm/s [m^4/s^4], below which the surface of a disc is replaced by that at rest: an
ellipsoid with `m = 1/4`. Even in single precision it leaves nothing to divide by zero."""


def disc_friction(xp: Any, slide: Any, spin: Any) -> tuple[Any, Any, Any, Any]:
    """Sliding friction of a disc, `c_t`, `c_s`, `m` and l [-], from `p = |u|^2` of its centre and `o = (a omega)^2`.

    The mean speed of the disc is `S = sqrt(p + m o)`, with `m = 1/4 + 7/36 (e_1 + A e_2)` and `(e_1, e_2, e_3) = (o^2,
    p o, p^2)/(o^2 + B p o + C p^2)`. Force and scaled torque of sliding are `W/S`, and W is S times the gradient of S:
    `W = (c_t u, c_s kappa a omega)`, `c_t = 1 + h e_1`, `c_s = 2 (m - h e_2)` and `h = 7/36 ((A - B) e_1 - 2 C e_2 - A
    C e_3)`. Within 0.0085 of the exact disc. A bristle across W decays more slowly, by the share `l = 0.54 e_1 + 1.70
    e_2`. (docs/discs.md)
    """
    return disc_friction_above(slide, spin, DISC_REST)


def disc_friction_above(slide: Any, spin: Any, rest: Any) -> tuple[Any, Any, Any, Any]:
    """`disc_friction` with p and o in any unit, that of their squares for `rest`, in which it takes `DISC_REST`."""
    pp = slide * slide
    po = slide * spin
    oo = spin * spin
    per = 1.0 / (oo + (DISC_B * po + DISC_C * pp) + rest)
    e_1 = oo * per
    e_2 = po * per
    e_3 = pp * per
    h = (
        (7.0 / 36.0 * (DISC_A - DISC_B)) * e_1
        - (7.0 / 18.0 * DISC_C) * e_2
        - (7.0 / 36.0 * DISC_A * DISC_C) * e_3
    )
    m = 0.25 + 7.0 / 36.0 * e_1 + (7.0 / 36.0 * DISC_A) * e_2
    across = ACROSS_SPIN * e_1 + ACROSS * e_2
    return 1.0 + h * e_1, 2.0 * (m - h * e_2), m, across


def disc_slip_share(
    xp: Any, deflection: Any, spin: Any, spin_speed: Any, breakaway_ratio: Any
) -> Any:
    """Share of the way from breakaway to full deflection, `(d E - s_ba)/(E - s_ba)`: the rim slips before the mean.

    The breakaway ratio of a disc is `s_ba/E`, `E = 1 + c y (2 - 5 y/3) + 60 x^2/y`. c is `UNEVEN`, y the square of the
    share r of spin in z: for c = 1 and x = 0, E is the evenness `<z^2>^2/<z^4>` of a rigid field. `x = max(0, s (r -
    s))` with the share s of spin in u: 0 while a disc is loaded for the first time, or slides. (docs/discs.md)
    """
    square = spin * spin
    more = xp.maximum(spin_speed * (spin - spin_speed), 0.0)
    first = 1.0 + square * (2.0 * UNEVEN - (5.0 / 3.0 * UNEVEN) * square)
    # Times y: one division does for both. Of a bristle without spin, nothing is 0/0, even in single precision.
    per = square + 1e-15
    uneven = first * per + TURNED * (more * more)
    rest = breakaway_ratio * per
    return (deflection * uneven - rest) / (uneven - rest)


# ---------------------------------------------------------------------- derivatives of a step (docs/differentiable.md)


def bristle_decay_by_breakaway(
    xp: Any, k_deflection: Any, deflection: Any, breakaway_ratio: Any
) -> Any:
    """Derivative of `k` with respect to the breakaway ratio, from that with respect to the deflection."""
    return (
        -k_deflection
        * xp.maximum(1.0 - deflection, 0.0)
        * (1.0 / (1.0 - breakaway_ratio))
    )


def relaxation_slope(xp: Any, decay_dt: Any, remaining: Any, mean: Any) -> Any:
    """Derivative of `(1 - exp(-x))/x`, the second result of `relaxation`; that of the first is `-exp(-x)`.

    Below `x = 0.1` its series, exact to 1e-16 there, where the difference would cancel.
    """
    x = decay_dt
    series = 1.0 / 5760.0 - x * (
        1.0 / 45360.0 - x * (1.0 / 403200.0 - x * (1.0 / 3991680.0))
    )
    series = 1.0 / 8.0 - x * (
        1.0 / 30.0 - x * (1.0 / 144.0 - x * (1.0 / 840.0 - x * series))
    )
    series = -0.5 + x * (1.0 / 3.0 - x * series)
    return xp.where(x > 0.1, remaining - mean, series) / xp.where(x > 0.1, x, 1.0)


def soft_finger(xp: Any, ratio: Any, k: Any) -> Any:
    """`k log p` of the relative pressure `p = (1 - (s/R)^k)^(1/k)` of a soft fingertip, `ratio = s/R` in (0, 1)."""
    return xp.log(-xp.expm1(k * xp.log(ratio)))


def turning_mean(xp: Any, angle: Any) -> tuple[Any, Any]:
    """`(1 - cos a)/a^2` and `(a - sin a)/a^3` of an angle `a >= 0`: the mean of a vector that turns by it.

    A velocity v that turns by the vector `a` in a step has the mean `v + (1 - cos a)/a^2 a x v + (a - sin a)/a^3 a x
    (a x v)`: its point goes along the chord of an arc. Below `a = 0.1` the second is its series, exact to 1e-13 there,
    where the difference would cancel. (docs/rotating-supports.md)
    """
    far = angle > 0.1
    square = angle * angle
    half = xp.where(angle > 0.0, 0.5 * angle, 1.0)
    along = xp.where(angle > 0.0, xp.sin(half) / half, 1.0)
    series = 1.0 / 6.0 - square * (
        1.0 / 120.0 - square * (1.0 / 5040.0 - square * (1.0 / 362880.0))
    )
    safe = xp.where(far, angle, 1.0)
    return 0.5 * along * along, xp.where(
        far, (safe - xp.sin(safe)) / (safe * safe * safe), series
    )
