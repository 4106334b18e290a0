"""Limit surfaces against closed forms and published numbers."""

import math

import numpy as np
import pytest
from scipy import special

import planarfriction as pf
from planarfriction.patch import PUBLISHED_PATCHES
from tests.support.refusals import refused

SURFACES = [
    pf.LimitSurfaceCells,
    pf.LimitSurfaceExact,
    pf.LimitSurfaceTable,
    pf.LimitSurfaceTablePublished,
    pf.LimitSurfaceEllipsoid,
]
POINT = pf.ContactPatch.points([(0.1, 0.2)])


def order(errors, refinement=2.0):
    """Observed order of convergence: slope of the best line through the logarithms."""
    steps = np.arange(len(errors)) * math.log(refinement)
    return -np.polyfit(steps, np.log(np.abs(errors)), 1)[0]


# ---------------------------------------------------------------------- closed forms


def ring_dissipation(slide, spin, radius):
    """`(2/pi)(v + omega R) E(4 v omega R/(v + omega R)^2)` of a ring of that radius."""
    rim = spin * radius
    return (
        2.0
        / math.pi
        * (slide + rim)
        * special.ellipe(4.0 * slide * rim / (slide + rim) ** 2)
    )


def ring(radius, points):
    """Equal points on a circle, none of them on an axis."""
    angle = 2.0 * math.pi * (np.arange(points) + 0.25) / points
    return pf.ContactPatch.points(radius * np.stack([np.cos(angle), np.sin(angle)], -1))


@pytest.mark.parametrize("slide", [0.0, 0.2, 0.5, 2.0, 5.0])
def test_ring(slide):
    radius = 0.03
    spin = 1.0
    surface = pf.LimitSurfaceCells(ring(radius, 200))
    phi = surface.dissipation((slide * radius, 0.0, spin))
    # The trapezoidal rule converges like 2^-200 where the centre of rotation is off the ring by half a radius or more.
    assert phi == pytest.approx(
        ring_dissipation(slide * radius, spin, radius), rel=1e-13
    )


def test_ring_with_the_centre_of_rotation_on_it():
    """The speed has a kink there: second order in the distance of the points."""
    errors = [
        pf.LimitSurfaceCells(ring(0.03, points)).dissipation((0.03, 0.0, 1.0))
        - ring_dissipation(0.03, 1.0, 0.03)
        for points in (50, 100, 200, 400)
    ]
    assert order(errors) == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize(
    ("make", "twist"),
    [
        *(
            (lambda n: pf.ContactPatch.disc(0.01, n), (0.6 * slide, -0.8 * slide, 1.0))
            for slide in (0.0, 0.0037, 0.012)
        ),
        *(
            (lambda n: pf.ContactPatch.rectangle(0.03, 0.012, n), (y, -x, 1.0))
            for x, y in ((0.0, 0.0), (0.0031, -0.0017), (0.02, 0.004))
        ),
    ],
)
def test_cells_converge_to_the_area(make, twist):
    """Cells cut by the rim, at their centroids; the centre of rotation in the patch and outside."""
    exact = pf.LimitSurfaceExact(make(1)).dissipation(twist)
    errors = [
        pf.LimitSurfaceCells(make(n)).dissipation(twist) / exact - 1.0
        for n in (10, 20, 40, 80)
    ]
    assert order(errors) > 1.7  # 2, and the scatter of where the kink lies in its cell
    assert abs(errors[-1]) < 2e-4


@pytest.mark.parametrize("direction", ["x", "y"])
@pytest.mark.parametrize(
    ("across", "along"), [(0.004, 0.002), (0.03, -0.01), (0.0, 0.02)]
)
def test_rod(direction, across, along):
    # Counter-clockwise spin moves the +x end of a rod along x up; the +y end of one along y to the left.
    twist = (along, across, 1.0) if direction == "x" else (-across, along, 1.0)
    line = pf.ContactPatch.line(0.02, 1, direction="x")
    exact = pf.LimitSurfaceExact(line).dissipation((along, across, 1.0))
    errors = [
        pf.LimitSurfaceCells(
            pf.ContactPatch.line(0.02, n, direction=direction)
        ).dissipation(twist)
        / exact
        - 1.0
        for n in (40, 80, 160, 320)
    ]
    # The midpoint rule on a smooth function, as long as the centre of rotation is off the rod by more than a cell.
    assert order(errors) == pytest.approx(2.0, abs=0.02)


# ---------------------------------------------------------------------- published numbers


@pytest.mark.parametrize(
    ("name", "radius"),
    [
        ("Square", 7.62546508),
        ("Circle", 6.35716049),
        ("Line", 4.94997984),
        ("LineGrad", 3.98779182),
        ("LineGradX", 3.98779182),
        ("NonConvex1", 8.59351153),
        ("NonConvex2", 6.55030174),
    ],
)
def test_contact_radius_as_published(name, radius):
    surface = pf.LimitSurfaceTablePublished(PUBLISHED_PATCHES[name]())
    # Half a unit of the last printed digit.
    assert surface.contact_radius * 1e3 == pytest.approx(radius, abs=0.5e-8)


@pytest.mark.parametrize(
    ("surface", "plateau"),
    [
        (pf.LimitSurfaceCells, -4.988662e-3),
        (pf.LimitSurfaceTablePublished, -4.949980e-3),
    ],
)
@pytest.mark.parametrize("spin", [1e-3, 1.0, 50.0])
def test_torque_plateaus_of_the_published_line(surface, plateau, spin):
    wrench = surface(PUBLISHED_PATCHES["Line"]()).wrench((0.0, 0.0, spin))
    # Half a unit of the last printed digit.
    assert wrench[2] == pytest.approx(plateau, abs=0.5e-9)
    # Sums of 21 terms that cancel.
    assert wrench[:2] == pytest.approx([0.0, 0.0], abs=1e-15)


# ---------------------------------------------------------------------- signs


@pytest.mark.parametrize("kind", SURFACES)
def test_pure_sliding(kind):
    """Unit force against the velocity, at the centre of pressure."""
    for name in ("LineGrad", "LineGradX", "NonConvex2"):
        patch = PUBLISHED_PATCHES[name]()
        x, y = patch.centre_of_pressure()
        for angle in np.linspace(0.0, 2 * math.pi, 8, endpoint=False) + 0.2:
            c = math.cos(angle)
            s = math.sin(angle)
            # Tables have 80 segments around: cos misses by (2 pi/80)^2/8 = 8e-4 linearly, 1e-6 cubically.
            allowed = 8e-4 if kind is pf.LimitSurfaceTablePublished else 2e-6
            assert kind(patch).wrench((c, s, 0.0)) == pytest.approx(
                [-c, -s, -(x * s - y * c)], abs=allowed
            )


@pytest.mark.parametrize("kind", SURFACES)
def test_a_gradient_pulls_to_its_heavy_side(kind):
    """Row 0 is the top: LineGrad is heavy at +y, LineGradX at -x; the wrench is about the origin, not about the CoP."""
    top = kind(PUBLISHED_PATCHES["LineGrad"]())
    left = kind(PUBLISHED_PATCHES["LineGradX"]())
    assert top.centre_of_pressure == pytest.approx([0.0, 10 / 3 * 0.02 / 21], abs=1e-17)
    assert left.centre_of_pressure == pytest.approx(
        [-10 / 3 * 0.02 / 21, 0.0], abs=1e-17
    )
    # Sliding to the right, friction pulls the heavy top to the left: counter-clockwise.
    assert top.wrench((1.0, 0.0, 0.0)) == pytest.approx(
        [-1.0, 0.0, 3.174603e-3], abs=1e-9
    )
    # Sliding up, friction pulls the heavy left end down: counter-clockwise.
    assert left.wrench((0.0, 1.0, 0.0)) == pytest.approx(
        [0.0, -1.0, 3.174603e-3], abs=1e-9
    )
    # Spinning counter-clockwise about the origin, the top moves left and is pulled right, the left end moves down and
    # is pulled up; the torque opposes the spin.
    force_top = top.wrench((0.0, 0.0, 1.0))
    force_left = left.wrench((0.0, 0.0, 1.0))
    assert force_top[0] > 0.3 and abs(force_top[1]) < 1e-9 and force_top[2] < 0.0
    assert force_left[1] > 0.3 and abs(force_left[0]) < 1e-9 and force_left[2] < 0.0


# ---------------------------------------------------------------------- tables


def smooth_disc(cells=101):
    """Disc whose pressure and its first derivatives vanish at the rim: its dissipation is smooth."""
    return pf.ContactPatch.disc_published(
        0.01,
        cells,
        pressure=lambda x, y: (
            max(0.0, 1.0 - (x * x + y * y) / 0.01**2) ** 3 * (1.0 + 60.0 * x)
        ),
    )


def some_twists(count=300):
    """Twists in all directions of the scaled sphere."""
    twist = np.random.default_rng(5).normal(size=(count, 3))
    return twist * (1.0, 1.0, 1.0 / 0.004)


def test_tables_converge():
    patch = smooth_disc()
    twist = some_twists()
    surface = pf.LimitSurfaceExact(patch)
    cells = pf.LimitSurfaceCells(smooth_disc(201))
    exact_phi = surface.dissipation(twist)
    exact = surface.wrench(twist) / (1.0, 1.0, surface.contact_radius)
    summed = cells.wrench(twist) / (1.0, 1.0, cells.contact_radius)
    phi_errors = []
    smooth = []
    published = []
    for segments in (8, 16, 32):
        table = pf.LimitSurfaceTable(patch, segments)
        phi_errors.append(np.abs(table.dissipation(twist) / exact_phi - 1.0).mean())
        smooth.append(
            np.abs(
                table.wrench(twist) / (1.0, 1.0, table.contact_radius) - exact
            ).mean()
        )
        table = pf.LimitSurfaceTablePublished(smooth_disc(201), segments)
        published.append(
            np.abs(
                table.wrench(twist) / (1.0, 1.0, table.contact_radius) - summed
            ).mean()
        )
    # Bicubic potential: fourth order, its gradient third; bilinear: second order.
    assert order(phi_errors) > 3.7
    assert order(smooth) > 2.8
    assert order(published) == pytest.approx(2.0, abs=0.25)
    assert smooth[-1] < 0.1 * published[-1]
    assert smooth_table_is_convex(patch)
    # Beside the equator (almost pure sliding), where both halves meet, it is as good as elsewhere.
    twist[:, 2] *= 0.05
    miss = (pf.LimitSurfaceTable(patch).wrench(twist) - surface.wrench(twist)) / (
        1.0,
        1.0,
        surface.contact_radius,
    )
    assert np.abs(miss).mean() < 4e-6


def smooth_table_is_convex(patch):
    """No direction in which the stored dissipation curves downwards by more than rounding."""
    slopes = pf.LimitSurfaceTable(patch).jacobian(some_twists())
    r = patch.contact_radius()
    scaled = slopes / np.outer((1.0, 1.0, r), (1.0, 1.0, r))
    return bool((np.linalg.eigvalsh(scaled) <= 1e-11 * np.abs(scaled).max()).all())


@pytest.mark.parametrize("name", PUBLISHED_PATCHES)
@pytest.mark.parametrize(
    ("kind", "allowed"),
    [(pf.LimitSurfaceTable, 0.02), (pf.LimitSurfaceTablePublished, 0.02)],
)
def test_tables_follow_the_cells_of_published_patches(name, kind, allowed):
    patch = PUBLISHED_PATCHES[name]()
    cells = pf.LimitSurfaceCells(patch)
    table = kind(patch)
    scale = (1.0, 1.0, cells.contact_radius)
    miss = np.linalg.norm(
        (table.wrench(some_twists()) - cells.wrench(some_twists())) / scale, axis=-1
    )
    # Cells jump by up to 2 w as the centre of rotation crosses one (w = 1/21 on lines); tables do not. On average:
    assert miss.mean() < allowed


@pytest.mark.parametrize("name", PUBLISHED_PATCHES)
def test_smooth_table_at_the_spin_axis(name):
    """A patch without symmetry has a force in a pure spin; polar coordinates must neither lose it nor blow up there."""
    surface, exact = (
        kind(PUBLISHED_PATCHES[name]())
        for kind in (pf.LimitSurfaceTable, pf.LimitSurfaceExact)
    )
    r = surface.contact_radius
    x, y = surface.centre_of_pressure
    spin = np.array([y, -x, 1.0])
    # A node.
    assert surface.wrench(spin) / (1.0, 1.0, r) == pytest.approx(
        exact.wrench(spin) / (1.0, 1.0, r), abs=1e-7
    )
    for distance in (1e-3, 1e-5, 1e-7, 1e-9, 0.0):
        for angle in (0.3, 2.0, 4.0):
            nearby = spin + distance * r * np.array(
                [math.cos(angle), math.sin(angle), 0.0]
            )
            jump = surface.wrench(nearby) - surface.wrench(spin)
            # Slopes of the scaled map are below 40 even where the table meets single cells (lines).
            assert np.abs(jump / (1.0, 1.0, r)).max() <= 40.0 * distance + 1e-15
            slope = surface.jacobian(nearby)
            scaled = slope * np.outer((1.0, 1.0, 1.0 / r), (1.0, 1.0, 1.0 / r)) * r
            assert np.abs(scaled).max() < 40.0


# ---------------------------------------------------------------------- patches that depend on the load


def test_the_load_fixes_the_shape():
    patch = pf.ContactPatch.disc(
        0.01, 41, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0, radius_max=0.01)
    )
    for kind in SURFACES:
        small = kind(patch, normal_force=0.5)
        large = kind(patch, normal_force=2.0)
        # r = 3 pi/16 R on cells of 0.5 mm in a radius of 5 mm: a percent.
        assert small.contact_radius == pytest.approx(
            3 * math.pi / 16 * 0.006 * 0.5 ** (1 / 3), rel=0.02
        )
        assert large.contact_radius == pytest.approx(
            3 * math.pi / 16 * 0.006 * 2.0 ** (1 / 3), rel=0.02
        )
        twist = (0.003, 0.0, 1.0)
        again = small.at(2.0)
        assert type(again) is kind
        assert np.array_equal(again.wrench(twist), large.wrench(twist))
        with refused("normal_force must be given"):
            kind(patch).wrench(twist)


def test_a_fixed_shape_ignores_the_load():
    surface = pf.LimitSurfaceTable(PUBLISHED_PATCHES["Square"](), segments=4)
    assert surface.at(3.0) is surface


# ---------------------------------------------------------------------- wrong input


@pytest.mark.parametrize("kind", SURFACES)
def test_a_single_point_has_no_limit_surface(kind):
    with refused(
        r"patch must have a contact radius > 0 \(more than one point\), got r=0"
    ):
        kind(POINT)
    shrunk = pf.ContactPatch.rectangle(
        0.02, cells=21, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0)
    )
    # Only the middle cell is left, and it has a size.
    if kind in (
        pf.LimitSurfaceExact,
        pf.LimitSurfaceTable,
    ):
        assert kind(shrunk, normal_force=1e-9).contact_radius == pytest.approx(
            0.3826 * 0.02 / 21, rel=1e-4
        )
        return
    with refused("contact radius > 0"):
        kind(shrunk, normal_force=1e-9)


SQUARE = PUBLISHED_PATCHES["Square"]()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda s: s.wrench((1.0, 0.0)),
            r"twist must have shape \[..., 3\], got shape \[2\]",
        ),
        (lambda s: s.wrench(1.0), r"twist must have shape \[..., 3\], got shape \[\]"),
        (lambda s: s.dissipation((1.0, math.nan, 0.0)), "twist must be finite"),
        (lambda s: s.jacobian((1.0, math.inf, 0.0)), "twist must be finite"),
        (lambda s: s.wrench("fast"), "twist must be an array of numbers, got 'fast'"),
        (lambda s: s.twist((0.0, 0.0, 0.0)), "wrench must not be zero"),
        (
            lambda s: s.twist([(1.0, 0.0, 0.0), (0.0, 0.0, 0.0)]),
            "wrench must not be zero",
        ),
        (lambda s: s.twist((1.0, 0.0)), r"wrench must have shape \[..., 3\]"),
        (lambda s: s.twist((1.0, 0.0, math.nan)), "wrench must be finite"),
        (lambda s: type(s)("square"), "patch must be a ContactPatch, got 'square'"),
        (
            lambda s: type(s)(SQUARE, normal_force=0.0),
            "normal_force must be > 0, got 0.0",
        ),
        (
            lambda s: type(s)(SQUARE, normal_force=-1.0),
            "normal_force must be > 0, got -1.0",
        ),
    ],
)
@pytest.mark.parametrize("kind", SURFACES)
def test_wrong_input_gets_one_line(kind, call, message):
    with refused(message):
        call(kind(SQUARE))


@pytest.mark.parametrize("kind", [pf.LimitSurfaceTable, pf.LimitSurfaceTablePublished])
@pytest.mark.parametrize("segments", [1, 2.5, "many", math.nan])
def test_wrong_number_of_segments(kind, segments):
    with refused("segments must be"):
        kind(SQUARE, segments)
