"""Laws that are functions of their own, for tests."""

from __future__ import annotations

from dataclasses import dataclass

from planarfriction.laws.rate_law import RateLaw, dot, norm, plus, ratio, times


@dataclass(frozen=True)
class BoucWen(RateLaw):
    """Bristles that yield gradually: `zdot = v - |z/z_max|^n (beta |v_e| + (1 - beta) v_e) e`, with `v_e = v . e`."""

    mu: float = 0.4
    sigma_0: float = 1e5
    beta: float = 0.7
    n: float = 1.5

    @property
    def largest_deflection(self):
        return self.mu / self.sigma_0

    @staticmethod
    def bristle_rate(xp, law, z, v):
        size = norm(z)
        stretch = ratio(dot(v, z), size)
        loss = xp.maximum(stretch, (1.0 - 2.0 * law.beta) * stretch)
        return plus(
            v, -ratio(xp.power(size / law.largest_deflection, law.n) * loss, size), z
        )


@dataclass(frozen=True)
class Written(RateLaw):
    """Plain LuGre once more, with a traction of its own."""

    mu_c: float = 0.8
    mu_s: float = 1.0
    v_s: float = 1e-3
    sigma_0: float = 1e5
    sigma_1: float = 100.0
    sigma_2: float = 0.2

    @property
    def largest_deflection(self):
        return self.mu_s / self.sigma_0

    @staticmethod
    def bristle_rate(xp, law, z, v):
        speed = norm(v)
        power = 1.0
        for _ in range(2):
            power = power * (speed / law.v_s)
        g = law.mu_c + (law.mu_s - law.mu_c) * xp.exp(-power)
        return plus(v, -law.sigma_0 * speed / g, z)

    @staticmethod
    def bristle_traction(xp, law, z, zdot, v):
        return times(
            -1.0, plus(plus(times(law.sigma_0, z), law.sigma_1, zdot), law.sigma_2, v)
        )


@dataclass(frozen=True)
class Gum(BoucWen):
    """Bristles that flow at rest."""

    time: float = 0.05

    @staticmethod
    def bristle_rate(xp, law, z, v):
        return plus(v, -1.0 / law.time, z)
