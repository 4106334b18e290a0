"""Lookup in stored limit surfaces, with the analytic derivative of `kernels.surfaces` as its backward pass.

A direction `V_S/|V_S|` with `s >= 0` has a polar angle from the spin axis and an azimuth; `u` is homogeneous of degree
1 in `V_S`, so that `du/dV_S = h (x) radial + dh/dpolar (x) along + dh/dazimuth/sin(polar) (x) across`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import torch
from torch import Tensor

from planarfriction.kernels.surfaces import _AXIS as AXIS
from planarfriction.torch import namespace as xp


class Place(NamedTuple):
    """Where a direction lies in a table; scalars are `[...]`."""

    mirror: Tensor
    """-1 for the lower half sphere, which mirrors the upper, else 1."""
    polar: Tensor
    """Angle from the spin axis [rad]."""
    azimuth: Tensor
    """Angle of the velocity [rad]."""
    a: Tensor
    """Position within the table cell along the polar angle, 0 to 1."""
    b: Tensor
    """Position within the table cell along the azimuth, 0 to 1."""
    corners: Tensor
    """Nodes of the table cell `[..., 2, 2, 4]`, polar angle first."""
    segment: float
    """Side of a table cell [rad]."""


def _place(scaled: Tensor, nodes: Tensor, *, off_axis: bool = False) -> Place:
    """Find the table cell; `off_axis` keeps the polar angle from falling below the one that slopes can be taken at."""
    rows, columns = nodes.shape[0] - 1, nodes.shape[1]
    per_segment = rows / (0.5 * math.pi)
    mirror = torch.where(scaled[..., 2] < 0.0, -1.0, 1.0).to(scaled.dtype)
    x, y, s = (mirror * scaled[..., i] for i in range(3))
    across = xp.norm(scaled[..., :2], -1)[..., 0]
    polar = torch.atan2(across, s)
    if off_axis:
        polar = torch.where(polar < AXIS, AXIS, polar)
    on_axis = across == 0.0
    azimuth = torch.atan2(torch.where(on_axis, 0.0, y), torch.where(on_axis, 1.0, x))
    azimuth = torch.where(azimuth < 0.0, azimuth + 2.0 * math.pi, azimuth)
    a, b = polar * per_segment, azimuth * per_segment
    i, j = a.detach().long().clamp(0, rows - 1), b.detach().long().clamp(0, columns - 2)
    first = i * columns + j
    four = torch.stack([first, first + 1, first + columns, first + columns + 1], -1)
    corners = nodes.reshape(-1, 4)[four].unflatten(-2, (2, 2))
    return Place(mirror, polar, azimuth, a - i, b - j, corners, 1.0 / per_segment)


def _directions(place: Place) -> tuple[Tensor, Tensor, Tensor]:
    """Unit vectors `[..., 3]`: radial, of growing polar angle (along), of growing azimuth (across)."""
    sin_p, cos_p = torch.sin(place.polar), torch.cos(place.polar)
    sin_a, cos_a = torch.sin(place.azimuth), torch.cos(place.azimuth)
    return (
        torch.stack([sin_p * cos_a, sin_p * sin_a, cos_p], -1),
        torch.stack([cos_p * cos_a, cos_p * sin_a, -sin_p], -1),
        torch.stack([-sin_a, cos_a, torch.zeros_like(sin_a)], -1),
    )


def _outer(first: Tensor, second: Tensor) -> Tensor:
    return first[..., :, None] * second[..., None, :]


class _Lookup(torch.autograd.Function):
    """`u` of scaled twists `[..., 3]` that are not zero; subclasses give the value and the slope."""

    generate_vmap_rule = True

    @staticmethod
    def setup_context(ctx, inputs, output):
        ctx.save_for_backward(*inputs)

    @classmethod
    def slope(cls, scaled: Tensor, nodes: Tensor, tilt: Tensor) -> Tensor:
        """`du/dV_S` `[..., 3, 3]`."""
        raise NotImplementedError


class Bilinear(_Lookup):
    """The published table: `h` bilinear in the two angles."""

    @staticmethod
    def forward(scaled: Tensor, nodes: Tensor, tilt: Tensor) -> Tensor:
        """`u = h(V) |V_S|`."""
        place = _place(scaled, nodes)
        a, b = place.a[..., None], place.b[..., None]
        row = place.corners[..., 0, :, :3] + a[..., None] * (
            place.corners[..., 1, :, :3] - place.corners[..., 0, :, :3]
        )
        h = row[..., 0, :] + b * (row[..., 1, :] - row[..., 0, :])
        return place.mirror[..., None] * h * xp.norm(scaled, -1)

    @staticmethod
    def slope(scaled: Tensor, nodes: Tensor, tilt: Tensor) -> Tensor:
        """`du/dV_S` of the cell that the lookup uses."""
        place = _place(scaled, nodes, off_axis=True)
        radial, along, across = _directions(place)
        h = place.corners[..., :3]
        a, b = place.a[..., None], place.b[..., None]
        by_polar, by_azimuth = h[..., 1, :, :] - h[..., 0, :, :], h[..., :, 1, :] - h[..., :, 0, :]
        polar_slope = (by_polar[..., 0, :] + b * (by_polar[..., 1, :] - by_polar[..., 0, :])) / place.segment
        azimuth_slope = (by_azimuth[..., 0, :] + a * (by_azimuth[..., 1, :] - by_azimuth[..., 0, :])) / place.segment
        low = h[..., 0, 0, :] + b * by_azimuth[..., 0, :]
        value = low + a * place.segment * polar_slope
        azimuth_slope = azimuth_slope / torch.sin(place.polar)[..., None]
        return _outer(value, radial) + _outer(polar_slope, along) + _outer(azimuth_slope, across)

    @staticmethod
    def backward(ctx, *bars):
        """Vector-Jacobian product."""
        return (bars[0][..., None, :] @ Bilinear.slope(*ctx.saved_tensors))[..., 0, :], None, None


class Potential(_Lookup):
    """The smooth table: the dissipation bicubic in the two angles, `h` its gradient."""

    @staticmethod
    def forward(scaled: Tensor, nodes: Tensor, tilt: Tensor) -> Tensor:
        """`u = d(|V_S| phi)/dV_S |V_S|`, with the tilt about the spin axis."""
        place = _place(scaled, nodes)
        phi, d_polar, d_azimuth = _blends(place, ((0, 0), (1, 0), (0, 1)))
        radial, along, across = _directions(place)
        sin_p = torch.sin(place.polar)
        d_across = d_azimuth / torch.where(sin_p >= AXIS, sin_p, AXIS)
        speed = xp.norm(scaled, -1)
        unit = place.mirror[..., None] * scaled / speed
        c, n = _tilt(tilt, unit)
        h = phi[..., None] * radial + d_polar[..., None] * along + d_across[..., None] * across
        return place.mirror[..., None] * speed * (h + n - 2.0 * c[..., None] * unit)

    @staticmethod
    def slope(scaled: Tensor, nodes: Tensor, tilt: Tensor) -> Tensor:
        """`du/dV_S`: the second derivative of the dissipation, times `|V_S|`, and its homogeneous part."""
        place = _place(scaled, nodes, off_axis=True)
        wanted = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
        phi, d_p, d_a, d_pp, d_pa, d_aa = (value[..., None] for value in _blends(place, wanted))
        radial, along, across = _directions(place)
        sin_p, cos_p = torch.sin(place.polar)[..., None], torch.cos(place.polar)[..., None]
        axis = torch.eye(3, dtype=scaled.dtype, device=scaled.device)
        lean = torch.nn.functional.pad(tilt, (0, 1))
        c, n = _tilt(tilt, radial)
        c = c[..., None]
        h = phi * radial + d_p * along + d_a / sin_p * across + n - 2.0 * c * radial
        m_pp = phi + d_pp
        m_pa = (d_pa - d_a * cos_p / sin_p) / sin_p
        m_aa = phi + (d_p * cos_p + d_aa / sin_p) / sin_p
        to_axis = 2.0 * cos_p * lean + 2.0 * (radial @ lean)[..., None] * axis[2]
        result = _outer(h + 8.0 * c * radial - 2.0 * n, radial)
        result = result + _outer(m_pp * along + m_pa * across, along) + _outer(m_pa * along + m_aa * across, across)
        result = result + _outer(to_axis, axis[2]) - 2.0 * _outer(radial, n) + 2.0 * _outer(cos_p * axis[2], lean)
        return result - 2.0 * c[..., None] * axis

    @staticmethod
    def backward(ctx, *bars):
        """Vector-Jacobian product."""
        return (bars[0][..., None, :] @ Potential.slope(*ctx.saved_tensors))[..., 0, :], None, None


def _tilt(tilt: Tensor, unit: Tensor) -> tuple[Tensor, Tensor]:
    """`c = (a . V) s^2/|V|^2` `[...]` of unit vectors and `n` `[..., 3]`: the gradient of c is `n - 2 c V`."""
    s = unit[..., 2]
    lean = tilt[0] * unit[..., 0] + tilt[1] * unit[..., 1]
    return lean * s * s, torch.stack([tilt[0] * s * s, tilt[1] * s * s, 2.0 * lean * s], -1)


def _hermite(t: Tensor) -> Tensor:
    """Cubic Hermite basis on [0, 1] `[..., derivative, 4]`: of value 0, of value 1 less value 0, of slope 0 and 1."""
    u, one = 1.0 - t, torch.ones_like(t)
    value = (one, t * t * (3.0 - 2.0 * t), t * u * u, -t * t * u)
    first = (0.0 * one, 6.0 * t * u, u * (1.0 - 3.0 * t), t * (3.0 * t - 2.0))
    second = (0.0 * one, 6.0 - 12.0 * t, 6.0 * t - 4.0, 6.0 * t - 2.0)
    return torch.stack([torch.stack(basis, -1) for basis in (value, first, second)], -2)


def _blends(place: Place, orders: tuple[tuple[int, int], ...]) -> list[Tensor]:
    """Derivatives `[...]` of the bicubic patch, of the given orders along polar angle and azimuth."""
    segment = place.segment
    patch = place.corners.unflatten(-1, (2, 2))  # [..., i, j, azimuth slope, polar slope]
    patch = patch.movedim((-1, -4, -2, -3), (-4, -3, -2, -1)).flatten(-4, -3).flatten(-2, -1)
    scale = patch.new_tensor([1.0, 1.0, segment, segment])
    first, second, *slopes = (patch * scale * scale[:, None]).unbind(-1)
    patch = torch.stack([first, second - first, *slopes], -1)
    first, second, *slopes = patch.unbind(-2)
    patch = torch.stack([first, second - first, *slopes], -2)
    patch = _hermite(place.a) @ patch @ _hermite(place.b).mT
    return [patch[..., i, j] / segment ** (i + j) for i, j in orders]
