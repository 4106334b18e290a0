"""Numbers of a state as an HTML table."""

from __future__ import annotations

from planarfriction_explorer import looks, pictures
from planarfriction_explorer.answers import Answer
from planarfriction_explorer.state import State

_ROWS = {
    "friction": "Friction, steady sliding",
    "surface": "Limit surface, μ<sub>c</sub> f<sub>N</sub>",
    "ellipsoid": "Ellipsoid",
}


def numbers(state: State, found: Answer, seconds: float) -> str:
    """Return the table of the wrenches, centre of rotation, power, and the error of the ellipsoid."""
    rows = "".join(
        f"<tr><td style='color:{pictures.COLOURS[name]}'><b>{text}</b></td>"
        + "".join(f"<td>{value:.4f}</td>" for value in _shown(found, name))
        + "</tr>"
        for name, text in _ROWS.items()
    )
    (force, angle), centre = state.drawing.largest_errors, state.centre_of_rotation
    where = "none, no spin" if centre is None else f"({1e3 * centre[0]:.2f}, {1e3 * centre[1]:.2f}) mm"
    return (
        f"{looks.TABLE}<div id='answer'><table><tr><th></th><th>fx [N]</th><th>fy [N]</th><th>τ [N mm]</th></tr>{rows}"
        f"</table><p>Centre of rotation: {where}. Dissipated power: {1e3 * found.power:.4g} mW.</p>"
        f"<p>The ellipsoid is off by {found.force_error:.3f} of μ<sub>c</sub> f<sub>N</sub> in the wrench and by "
        f"{found.angle_error:.1f}° in the twist here; over all directions by up to {max(force, found.force_error):.3f} "
        f"and {max(angle, found.angle_error):.1f}°.</p><p><small>Answered in {1e3 * seconds:.1f} ms</small></p></div>"
    )


def _shown(found: Answer, name: str) -> list[float]:
    """Return a wrench in N and N mm, without -0."""
    fx, fy, tau = getattr(found, name)
    return [round(each, 4) + 0.0 for each in (fx, fy, 1e3 * tau)]
