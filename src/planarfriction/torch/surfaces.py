"""Limit surfaces as buffers of a module: `u = h(V) |V_S|` of scaled twists and its derivative.

What the numbers mean, and the conventions, are those of `planarfriction.kernels.surfaces`: at rest the derivative is
the ellipsoid's, at the edge of a table cell that of the cell that the lookup uses.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from planarfriction.kernels import surfaces as kernels
from planarfriction.limit_surface import LimitSurface
from planarfriction.torch import tables


class Surface(nn.Module):
    """A limit surface; `forward(scaled, speed)` gives `u` `[..., 3]` of scaled twists `[..., 3]` of norm `[..., 1]`."""

    def forward(self, scaled: Tensor, speed: Tensor) -> Tensor:
        """`u = h(V) |V_S|`."""
        moving = speed > 0.0
        # at rest any twist will do for the table: the result is not used
        u = self.sliding(torch.where(moving, scaled, 1.0), torch.where(moving, speed, 3.0**0.5))
        return torch.where(moving, u, scaled)

    def sliding(self, scaled: Tensor, speed: Tensor) -> Tensor:
        """`u` of twists that are not zero."""
        raise NotImplementedError


class Ellipsoid(Surface):
    """`u = V_S`."""

    def forward(self, scaled: Tensor, speed: Tensor) -> Tensor:
        """`u = V_S`, at rest too."""
        return scaled


class Cells(Surface):
    """`u = |V_S| sum w_i [v_i/|v_i| ; rho_i x v_i/|v_i|]` over the cells."""

    cells: Tensor
    """x / r, y / r, w: `[3, N]`."""

    def __init__(self, cells: Tensor):
        super().__init__()
        self.register_buffer("cells", cells)

    def sliding(self, scaled: Tensor, speed: Tensor) -> Tensor:
        """A cell that stands in the centre of rotation adds nothing."""
        x, y, weights = self.cells
        vx, vy, spin = (scaled / speed).split(1, -1)
        ux, uy = vx - spin * y, vy + spin * x
        square = ux * ux + uy * uy
        slides = square > _at_rest(square.dtype) ** 2
        share = torch.where(slides, weights / torch.sqrt(torch.where(slides, square, 1.0)), 0.0)
        sums = [(share * part).sum(-1) for part in (ux, uy, x * uy - y * ux)]
        return torch.stack(sums, -1) * speed


class Table(Surface):
    """A stored surface of either kind: nodes over polar angle and azimuth."""

    nodes: Tensor
    """`[size + 1, 4 size + 1, 4]`"""
    tilt: Tensor
    """Force of a pure spin `[2]` (smooth table); zero for the published one."""

    def __init__(self, nodes: Tensor, tilt: Tensor, *, smooth: bool):
        super().__init__()
        self.register_buffer("nodes", nodes)
        self.register_buffer("tilt", tilt)
        self.lookup = tables.Potential if smooth else tables.Bilinear

    def sliding(self, scaled: Tensor, speed: Tensor) -> Tensor:
        """The lower half sphere mirrors the upper."""
        return self.lookup.apply(scaled, self.nodes, self.tilt)  # pyright: ignore[reportReturnType]


def _at_rest(dtype: torch.dtype) -> float:
    """Share of the twist below which a cell's speed is rounding."""
    return kernels._AT_REST * torch.finfo(dtype).eps / torch.finfo(torch.float64).eps


def surface_of(surface: LimitSurface, **kind) -> Surface:
    """The module of a limit surface; `kind` is the dtype and the device of its buffers."""
    numbers = surface.numbers
    data = torch.as_tensor(np.asarray(numbers.data), **kind)
    if numbers.kind == kernels.ELLIPSOID:
        return Ellipsoid()
    if numbers.kind == kernels.CELLS:
        return Cells(data.reshape(3, -1))
    shape = (numbers.size + 1, 4 * numbers.size + 1, 4)
    count = shape[0] * shape[1] * shape[2]
    smooth = numbers.kind == kernels.POTENTIAL
    tilt = data[count : count + 2] if smooth else data.new_zeros(2)
    return Table(data[:count].reshape(shape), tilt, smooth=smooth)
