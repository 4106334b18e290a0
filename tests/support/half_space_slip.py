"""Partial slip on a half-space by a boundary element method: the tractions under a face that was moved from rest."""

import numpy as np

from planarfriction import half_space


class SlippingHalfSpace:
    """A half-space of cells `[N, 2]` with sides [m]; a rigid face slips on it with the friction coefficient 1.

    Among all tractions within the friction of their cells those are right whose energy less the work of the face is
    least; projected gradients with momentum (Nesterov 1983) find them. Each path is one step from rest, or from the
    tractions before it.
    """

    def __init__(self, positions, sides, shear_modulus, poisson_ratio):
        self.positions = positions
        self.area = sides[0] * sides[1]
        sizes = np.broadcast_to(sides, positions.shape)
        alike = positions, sizes, shear_modulus, poisson_ratio
        self.soft = half_space.compliances(positions, *alike)
        self.steepest = np.linalg.eigvalsh(self.soft)[-1]

    def tractions(self, shift, load, tractions=None, displacement=None):
        """Return tractions `[N, 2]` [Pa] after a shift `[3]`, with loads `[N]` [N]; others are those before it."""
        x, y = self.positions.T
        moved = np.concatenate([shift[0] - shift[2] * y, shift[1] + shift[2] * x])
        if displacement is not None:
            moved = moved + displacement
        bound = load / self.area
        q = np.zeros((len(load), 2)) if tractions is None else tractions
        ahead = q
        momentum = 1.0
        for _ in range(1500):
            slope = self.soft @ ahead.T.ravel() - moved
            new = ahead - slope.reshape(2, -1).T / self.steepest
            size = np.hypot(*new.T)
            new = new * np.minimum(1.0, bound / np.maximum(size, 1e-300))[:, None]
            further = 0.5 * (1.0 + np.sqrt(1.0 + 4.0 * momentum**2))
            if ((ahead - new) * (new - q)).sum() > 0.0:
                further = 1.0
            ahead = new + (momentum - 1.0) / further * (new - q)
            change = np.abs(new - q).max()
            q = new
            momentum = further
            if change < 1e-7 * bound.max():
                break
        return q

    def wrench(self, tractions):
        """Return the wrench of tractions about the origin [3]."""
        force = tractions * self.area
        x, y = self.positions.T
        return np.array([*force.sum(0), x @ force[:, 1] - y @ force[:, 0]])
