"""Examples to begin with: contacts of robots, each a state of the screen."""

from __future__ import annotations

import numpy as np

from planarfriction.laws import LuGre
from planarfriction_explorer.drawing import Drawing
from planarfriction_explorer.state import State


def _finger() -> Drawing:
    """Return a soft fingertip 14 mm wide, whose pressure falls to the rim as that of Hertz."""
    x = (np.arange(28) + 0.5) / 14.0 - 1.0
    return Drawing(np.sqrt(np.clip(1.0 - x[:, None] ** 2 - x**2, 0.0, None)).round(3), 0.5e-3)


def _foot() -> Drawing:
    """Return an L of two bars, 60 mm long and 20 mm wide."""
    pressures = np.zeros((24, 24))
    pressures[:, :8] = pressures[16:, :] = 1.0
    return Drawing(pressures, 2.5e-3)


def _box() -> Drawing:
    """Return the bottom of a box, 150 mm x 100 mm, which a push on its upper part presses on the edge ahead."""
    return Drawing(np.tile(np.linspace(0.2, 1.0, 30).round(3), (20, 1)), 5e-3)


PRESETS = {
    "two pads of a gripper": State(),
    "disc of a soft fingertip": State(
        _finger(), LuGre(mu_c=0.8, mu_s=1.0, elasto_plastic=0.9), 3.0, (0.004, 0.0, 1.0), 0.1, 0.015
    ),
    "L-shaped foot": State(_foot(), LuGre(mu_c=0.6, mu_s=0.7), 20.0, (0.0, 0.02, 0.8), 0.5, 0.0),
    "box pushed over a table": State(_box(), LuGre(mu_c=0.3, mu_s=0.4), 10.0, (0.05, 0.0, 0.5), 0.5, 0.0),
}
"""States by name; the first is that of a new page."""
