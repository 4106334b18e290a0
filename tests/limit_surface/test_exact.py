"""The exact limit surface: closed forms, certificates over random pressure maps, and the table that stores it."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import special

import planarfriction as pf
from planarfriction import geometry
from planarfriction.patch import PUBLISHED_PATCHES
from tests.support.limit_surfaces import gradient_error, jacobian_error, scaled_jacobian
from tests.support.refusals import refused

ELL = [(0.0, 0.0), (0.03, 0.0), (0.03, 0.01), (0.01, 0.01), (0.01, 0.04), (0.0, 0.04)]
"""Vertices of a polygon that is not convex."""


def scales(surface):
    """Scales of the wrench: forces against 1, torques against the contact radius."""
    return np.array([1.0, 1.0, surface.contact_radius])


def twists(surface, count=300, seed=3):
    """Twists in all directions of the scaled sphere, some nearly or quite a spin or a translation."""
    scaled = np.random.default_rng(seed).normal(size=(count, 3))
    scaled[:20, :2] *= 10.0 ** -np.arange(20.0)[:, None]
    scaled[20:40, 2] *= 10.0 ** -np.arange(20.0)
    scaled[40, 2] = 0.0
    scaled[41, :2] = 0.0
    return geometry.twist_at(scaled / scales(surface), -surface.centre_of_pressure)


def apart(surface, other, twist):
    """Largest difference of the scaled wrenches."""
    return float(
        np.abs((surface.wrench(twist) - other.wrench(twist)) / scales(surface)).max()
    )


def without_outline(patch):
    """The same cells, their outline forgotten."""
    bare = dataclasses.replace(patch)
    assert bare.outline is None
    return bare


# ---------------------------------------------------------------------- closed forms


def corner(a, b):
    """Integral of the distance from a corner over a rectangle a x b; odd in both."""
    a = np.where(a == 0.0, 1e-300, a)
    b = np.where(b == 0.0, 1e-300, b)
    sides = a**3 * np.arcsinh(b / np.abs(a)) + b**3 * np.arcsinh(a / np.abs(b))
    return (2.0 * a * b * np.hypot(a, b) + sides) / 6.0


def box_distance(width, height, centre):
    """Mean distance of a box about the origin from `centre`: a signed sum of four corners."""
    x, y = centre
    signs = [(sx, sy) for sx in (-1.0, 1.0) for sy in (-1.0, 1.0)]
    return sum(
        sx * sy * corner(sx * width / 2 - x, sy * height / 2 - y) for sx, sy in signs
    ) / (width * height)


@pytest.mark.parametrize("cells", [1, 21])
@pytest.mark.parametrize("outline", [True, False])
@pytest.mark.parametrize("height", [0.02, 0.005])
def test_rectangle(cells, outline, height):
    """One cell, 21 x 21 cells and the outline are the same continuous rectangle."""
    patch = pf.ContactPatch.rectangle(0.02, height, (cells, cells))
    surface = pf.LimitSurfaceExact(patch if outline else without_outline(patch))
    for centre in np.random.default_rng(1).uniform(-0.03, 0.03, size=(50, 2)):
        x, y = centre
        # The textbook form loses 1e-15 times the square of the distance over the side.
        assert surface.dissipation((y, -x, 1.0)) == pytest.approx(
            box_distance(0.02, height, centre), rel=1e-12
        )
    assert surface.contact_radius == pytest.approx(
        box_distance(0.02, height, (0.0, 0.0)), rel=1e-14
    )


def test_cells_make_up_the_square():
    """Wrench and Jacobian of 441 cells are those of the square, at every twist, centres of rotation on cells too."""
    patch = pf.ContactPatch.rectangle(0.02, cells=21)
    square = pf.LimitSurfaceExact(patch)
    cells = pf.LimitSurfaceExact(without_outline(patch))
    centres = np.concatenate([patch.positions[:60], patch.positions[:60] + 0.01 / 21])
    spins = np.stack([centres[:, 1], -centres[:, 0], np.ones(len(centres))], -1)
    for twist in (twists(square), spins):
        assert apart(square, cells, twist) < 1e-12
        slopes = scaled_jacobian(square, twist)
        others = scaled_jacobian(cells, twist)
        size = np.abs(slopes).max(axis=(1, 2), keepdims=True)
        assert (np.abs(slopes - others) / np.where(size > 0.0, size, 1.0)).max() < 1e-10


def test_sum_over_a_million_cells_agrees_to_its_own_error():
    square = pf.LimitSurfaceExact(pf.ContactPatch.rectangle(0.02))
    errors = []
    for cells in (251, 1001):
        summed = pf.LimitSurfaceCells(pf.ContactPatch.rectangle(0.02, cells=cells))
        errors.append(apart(square, summed, twists(square, 42)))
    # Near the centre of rotation a cell's share of 1/cells^2 is off by as much; a few dozen such cells matter.
    assert errors[0] < 60.0 / 251**2 and errors[1] < 60.0 / 1001**2


def disc_distance(distance, radius):
    """Mean distance of a disc from a point at that distance from its middle."""
    a = distance / radius
    m = min(a, 1.0 / a) ** 2
    first = special.ellipk(m)
    second = special.ellipe(m)
    inside = (7.0 + a * a) * second - 4.0 * (1.0 - a * a) * first
    outside = a * ((7.0 + a * a) * second - (3.0 + a * a) * (1.0 - m) * first)
    return 4.0 * radius / (9.0 * math.pi) * (inside if a < 1.0 else outside)


@pytest.mark.parametrize(
    "distance", [1e-6, 0.003, 0.0099, 0.00999999, 0.0100001, 0.02, 0.1]
)
def test_disc_and_ring(distance):
    disc = pf.LimitSurfaceExact(pf.ContactPatch.disc(0.01))
    ring = pf.LimitSurfaceExact(pf.ContactPatch.ring(0.006, 0.01))
    twist = (0.6 * distance, -0.8 * distance, 1.0)
    outer = disc_distance(distance, 0.01)
    inner = disc_distance(distance, 0.006)
    # The reference loses the square of distance/radius.
    assert disc.dissipation(twist) == pytest.approx(outer, rel=1e-12)
    assert ring.dissipation(twist) == pytest.approx(
        (outer * 0.01**2 - inner * 0.006**2) / 6.4e-5, rel=1e-12
    )


def test_disc_pulls_straight_in_translation():
    disc = pf.LimitSurfaceExact(pf.ContactPatch.disc(0.01))
    assert disc.wrench((3.0, 4.0, 0.0)) == pytest.approx([-0.6, -0.8, 0.0], abs=1e-14)
    assert disc.contact_radius == pytest.approx(0.02 / 3, rel=1e-14)
    assert disc.wrench((0.0, 0.0, -2.0)) == pytest.approx(
        [0.0, 0.0, 0.02 / 3], abs=1e-16
    )


@pytest.mark.parametrize("cells", [1, 21])
@pytest.mark.parametrize(
    ("across", "along"),
    [(0.004, 0.002), (0.03, -0.01), (0.0, 0.02), (0.001, 1e-9), (9.0, 4.0)],
)
def test_rod(cells, across, along):
    def integral(u):
        return u * math.hypot(u, along) + along**2 * math.asinh(u / abs(along))

    surface = pf.LimitSurfaceExact(pf.ContactPatch.line(0.02, cells, direction="x"))
    exact = (integral(across + 0.01) - integral(across - 0.01)) / 0.04
    # The reference loses its differences where the rod is fast.
    assert surface.dissipation((along, across, 1.0)) == pytest.approx(
        exact, rel=1e-13 * (1.0 + (across / 0.01) ** 2)
    )
    assert surface.contact_radius == pytest.approx(0.005, rel=1e-14)


@pytest.mark.parametrize("k", [0.5, 1.0, 2.0, 3.0, 40.0, 1e4])
def test_soft_finger_radius(k):
    """`r/R = 2 (3/8) Gamma(3/k)^2/(Gamma(2/k) Gamma(4/k))`, of a pure spin."""
    patch = pf.ContactPatch.disc(0.01, 161, pressure=pf.SoftFinger(c=0.008, k=k))
    ratio = (
        0.75 * special.gamma(3 / k) ** 2 / (special.gamma(2 / k) * special.gamma(4 / k))
    )
    radius = pf.LimitSurfaceExact(patch).contact_radius
    assert radius / 0.008 == pytest.approx(ratio, rel=1e-12)
    # Pressure at the cells' positions: 160 cells across, the rim's singularity costs most at k = 2 and above.
    torque = -pf.LimitSurfaceCells(patch).wrench((0.0, 0.0, 3.0))[2]
    assert torque == pytest.approx(radius, rel=1e-3)


def test_soft_finger_follows_the_load():
    patch = pf.ContactPatch.disc(0.01, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0))
    for load in (0.5, 2.0, 100.0):
        radius = 0.006 * load ** (1 / 3)
        surface = pf.LimitSurfaceExact(patch, normal_force=load)
        if radius < 0.01:
            assert surface.contact_radius == pytest.approx(
                3 * math.pi / 16 * radius, rel=1e-12
            )
        assert (
            apart(
                surface,
                pf.LimitSurfaceCells(patch, normal_force=load),
                twists(surface, 50),
            )
            < 0.05
        )
    with refused("normal_force must be given"):
        pf.LimitSurfaceExact(patch).wrench((1.0, 0.0, 0.0))


@pytest.mark.parametrize("turned", [False, True])
def test_polygon_is_the_sum_of_its_boxes(turned):
    vertices = ELL[::-1] if turned else ELL
    surface = pf.LimitSurfaceExact(pf.ContactPatch.polygon(vertices))
    assert surface.centre_of_pressure == pytest.approx([0.01, 0.015], rel=1e-13)
    for x, y in np.random.default_rng(2).uniform(-0.02, 0.06, size=(50, 2)):
        low = box_distance(0.03, 0.01, (x - 0.015, y - 0.005))
        high = box_distance(0.01, 0.03, (x - 0.005, y - 0.025))
        assert surface.dissipation((y, -x, 1.0)) == pytest.approx(
            0.5 * (low + high), rel=1e-12
        )


# ---------------------------------------------------------------------- properties over random pressure maps


@st.composite
def cases(draw):
    """An exact surface of a random pressure map, line or polygon, and its scaled twists `[2, 3]`."""
    seed = draw(st.integers(0, 10_000))
    shape = draw(st.sampled_from(["map", "line", "polygon", "finger"]))
    random = np.random.default_rng(seed)
    if shape == "map":
        pressure = random.uniform(size=random.integers(2, 6, size=2)) ** 3
        patch = pf.ContactPatch.from_pressure(
            pressure, random.uniform(0.001, 0.004, size=2)
        )
    elif shape == "line":
        patch = pf.ContactPatch.line(0.02, int(random.integers(2, 9)), profile=None)
        patch = dataclasses.replace(patch, pressure=random.uniform(size=patch.cells))
    elif shape == "polygon":
        # No gap of half a turn, which would make sides cross.
        angle = (np.arange(7) + random.uniform(size=7)) * 2.0 * math.pi / 7.0
        patch = pf.ContactPatch.polygon(
            0.02
            * random.uniform(0.3, 1.0, 7)[:, None]
            * np.stack([np.cos(angle), np.sin(angle)], -1)
        )
    else:
        patch = pf.ContactPatch.ring(
            0.004,
            0.01,
            pressure=pf.SoftFinger(c=0.02, k=float(random.uniform(0.5, 4.0))),
        )
    scaled = np.array([draw(st.floats(-1.0, 1.0)) for _ in range(6)]).reshape(2, 3)
    scaled[np.linalg.norm(scaled, axis=1) < 1e-3] = 1.0
    surface = pf.LimitSurfaceExact(patch)
    return surface, geometry.twist_at(
        scaled / scales(surface), -surface.centre_of_pressure
    )


checked = settings(deadline=None, max_examples=50)


@given(cases(), st.floats(1e-200, 1e90))
@checked
def test_certificates(case, size):
    surface, (twist, other) = case
    wrench = surface.wrench(twist)
    phi = surface.dissipation(twist)
    slope = scaled_jacobian(surface, twist)
    assert -wrench @ twist == pytest.approx(phi, rel=1e-12)
    assert surface.dissipation(size * twist) == pytest.approx(size * phi, rel=1e-12)
    # Convex: the triangle inequality, and no other wrench resists a twist more (its own is a subgradient).
    assert surface.dissipation(twist + other) <= (phi + surface.dissipation(other)) * (
        1.0 + 1e-13
    )
    assert -surface.wrench(other) @ twist <= phi * (1.0 + 1e-12)
    # The Jacobian is symmetric, negative semi-definite and zero along the twist, to the rounding of its largest entry.
    largest = np.abs(slope).max()
    along = geometry.twist_at(twist, surface.centre_of_pressure) * scales(surface)
    assert np.abs(slope - slope.T).max() <= 1e-12 * largest
    assert np.linalg.eigvalsh(slope).max() <= 1e-11 * largest
    assert np.abs(slope @ along).max() <= 1e-11 * largest * np.linalg.norm(along)


def test_a_spin_too_slow_to_divide_by_is_none():
    surface = pf.LimitSurfaceExact(pf.ContactPatch.disc(0.01))
    assert surface.dissipation((1.0, 0.0, 1e-320)) == surface.dissipation(
        (1.0, 0.0, 0.0)
    )


@given(cases())
@checked
def test_gradient_and_jacobian_are_slopes(case):
    surface, (twist, _) = case
    # On a line the slope is infinite, and beside it beyond the reach of differences.
    assume(surface.patch.name != "line" or abs(twist[1]) > 0.01)
    size = np.linalg.norm(twist * scales(surface))
    step = 1e-6 * size
    assert gradient_error(surface, twist, step) < 1e-8
    # The slope itself has a logarithm at corners of cells: its modulus at a step of 1e-6 is 1e-5 and some.
    assert jacobian_error(surface, twist, step) < 1e-4 / size


@given(cases())
@settings(deadline=None, max_examples=30)
def test_twist_of_a_wrench_comes_back(case):
    surface, (twist, _) = case
    curvature = np.sort(np.abs(np.linalg.eigvalsh(scaled_jacobian(surface, twist))))[1]
    found = surface.twist(surface.wrench(twist))
    back = surface.wrench(found) / scales(surface)
    assert back == pytest.approx(surface.wrench(twist) / scales(surface), abs=1e-10)
    if curvature > 0.02:  # flatter, and many twists have all but the same wrench
        assert found * scales(surface) == pytest.approx(
            twist / surface.dissipation(twist) * scales(surface), rel=1e-9, abs=1e-10
        )


@pytest.mark.parametrize("name", PUBLISHED_PATCHES)
def test_wrench_is_continuous_across_cells(name):
    """A walk of the centre of rotation over cells: no step is larger than its length allows; sums over cells jump."""
    patch = PUBLISHED_PATCHES[name]()
    surface = pf.LimitSurfaceExact(patch)
    cells = pf.LimitSurfaceCells(patch)
    start = patch.positions[patch.cells // 3]
    walk = start + np.linspace(-1e-6, 1e-6, 2001)[:, None] * (1.0, 0.37)
    spins = np.stack([walk[:, 1], -walk[:, 0], np.ones(len(walk))], -1)
    steps, jumps = (
        np.abs(np.diff(each.wrench(spins) / scales(each), axis=0)).max()
        for each in (surface, cells)
    )
    # Steps of 1e-9 m in cells of 1 mm: 1e-6 of a cell's weight (1/9 at most), times a logarithm (20) on lines.
    assert steps < 5e-6
    assert jumps > 0.5 * patch.weights().min()


# ---------------------------------------------------------------------- the table that stores it


@pytest.mark.parametrize("name", PUBLISHED_PATCHES)
def test_table_follows_the_exact_surface(name):
    """Lines have a kink's logarithm along them; what is left on the rest is the interpolation of 4.5 degrees."""
    patch = PUBLISHED_PATCHES[name]()
    exact = pf.LimitSurfaceExact(patch)
    table = pf.LimitSurfaceTable(patch)
    assert table.contact_radius == exact.contact_radius
    miss = np.linalg.norm(
        (table.wrench(twists(exact, 2000)) - exact.wrench(twists(exact, 2000)))
        / scales(exact),
        axis=1,
    )
    flat = name in ("Square", "Circle")
    assert miss.max() < (2e-3 if flat else 0.03)
    assert miss.mean() < (1e-4 if flat else 2e-4)


def test_table_of_a_pressure_map_is_convex():
    pressure = np.random.default_rng(1).uniform(size=(21, 21))
    table = pf.LimitSurfaceTable(pf.ContactPatch.from_pressure(pressure, 0.001))
    slopes = scaled_jacobian(table, twists(table, 500))
    # Rounding at twists 1e-20 from the axis.
    assert np.linalg.eigvalsh(0.5 * (slopes + np.swapaxes(slopes, 1, 2))).max() < 1e-8


# ---------------------------------------------------------------------- outlines and errors


@pytest.mark.parametrize(
    "patch",
    [
        pf.ContactPatch.disc(0.01, 5),
        pf.ContactPatch.ring(0.005, 0.01, 5),
        pf.ContactPatch.rectangle(0.02, 0.01, 5),
        pf.ContactPatch.polygon(ELL, 5),
    ],
    ids=lambda patch: patch.name,
)
def test_plain_data_keep_the_outline(patch):
    again = pf.ContactPatch.from_dict(patch.to_dict())
    surface = pf.LimitSurfaceExact(patch)
    other = pf.LimitSurfaceExact(again)
    assert np.array_equal(
        surface.wrench((0.1, 0.2, 3.0)), other.wrench((0.1, 0.2, 3.0))
    )
    assert again.to_dict() == patch.to_dict()


def test_another_pressure_is_integrated_over_the_cells():
    gradient = pf.ContactPatch.rectangle(
        0.02, cells=21, pressure=pf.LinearGradient((40.0, 0.0))
    )
    fine = pf.LimitSurfaceCells(gradient.refined(20))
    surface = pf.LimitSurfaceExact(gradient)
    assert surface.centre_of_pressure[0] > 1e-3
    assert apart(surface, fine, twists(surface, 50)) < 1e-3


def test_models_store_it_as_a_table():
    patch = PUBLISHED_PATCHES["Square"]()
    assert np.array_equal(
        pf.LimitSurfaceExact(patch).numbers.data,
        pf.LimitSurfaceTable(patch).numbers.data,
    )


@pytest.mark.parametrize(
    ("outline", "message"),
    [
        (
            {"radii": [0.2, 0.1]},
            r"radii must be \(inner, outer\) with 0 <= inner < outer",
        ),
        ({"vertices": [(0.0, 0.0)]}, "vertices must hold at least 3 points"),
        ({"corners": []}, "outline must be a table with either vertices or radii"),
    ],
)
def test_wrong_outlines_get_one_line(outline, message):
    data = PUBLISHED_PATCHES["Square"](3).to_dict() | {"outline": outline}
    with refused(message):
        pf.ContactPatch.from_dict(data)


def test_many_directions_of_a_disc_are_integrated_a_part_at_a_time():
    import tracemalloc

    surface = pf.LimitSurfaceExact(pf.ContactPatch.disc(0.01, 5))
    units = np.random.default_rng(3).normal(size=(20_000, 3))
    units /= np.linalg.norm(units, axis=-1, keepdims=True)
    tracemalloc.start()
    together = surface.direction(units)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 60e6  # 128 MB in one piece
    assert np.array_equal(together[-5:], surface.direction(units[-5:]))
