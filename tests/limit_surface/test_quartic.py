"""The convex quartic: exact where the surface is one, certified to be convex, closer than the ellipsoid elsewhere."""

import functools
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planarfriction as pf
from planarfriction._engine.published import surfaces as kernels
from planarfriction.errors import MissingExtraError
from planarfriction.limit_surface import quartic as quartic_fit
from planarfriction.patch import PUBLISHED_PATCHES
from tests.support.contacts import FEET
from tests.support.limit_surfaces import jacobian_error
from tests.support.refusals import refused

pytest.importorskip(
    "cvxpy", reason="cvxpy is not installed: the convex quartic is an extra"
)
pytestmark = pytest.mark.quartic

PATCHES = {
    name: PUBLISHED_PATCHES[name]()
    for name in ("Square", "Circle", "LineGrad", "NonConvex1")
}
PATCHES["feet"] = FEET
names = pytest.mark.parametrize("name", PATCHES)

checked = settings(deadline=None, max_examples=25)
twists = st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3).filter(
    lambda v: np.linalg.norm(v) > 0.1
)


@functools.cache
def fitted(name):
    """The quartic of a patch."""
    return pf.LimitSurfaceQuartic(PATCHES[name])


def samples(surface, count, seed=0):
    """Random twists in every direction of the scaled coordinates."""
    random = np.random.default_rng(seed).normal(size=(count, 3))
    return np.linalg.solve(surface._frame(), random.T).T


def convex_quartic(*coefficients):
    """`(x^2 + y^2 + z^2)^2` and a convex part: fourth powers of linear functions."""
    rows = np.array(
        [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 2.0, -1.0], [0.3, -1.0, 0.5]]
    )
    points = np.random.default_rng(1).normal(size=(60, 3))
    values = np.sum(points**2, axis=1) ** 2 + (points @ rows.T) ** 4 @ np.array(
        coefficients
    )
    return np.linalg.lstsq(quartic_fit.monomials(points), values, rcond=None)[0]


KNOWN, ELLIPSOID = (
    convex_quartic(0.3, 0.5, 0.02, 0.1),
    convex_quartic(0.0, 0.0, 0.0, 0.0),
)


# ---------------------------------------------------------------------- closed forms


@names
def test_the_ellipsoid_is_a_quartic(name):
    """Its square, with the Hessian `4 |x|^2 + 8 x x'` >= 4 |x|^2."""
    ellipsoid = pf.LimitSurfaceEllipsoid(PATCHES[name])
    quartic = pf.LimitSurfaceQuartic(PATCHES[name], surface=ellipsoid)
    # Least squares, to rounding.
    assert quartic.quartic == pytest.approx(ELLIPSOID, abs=1e-12)
    # Tolerance of the conic solver.
    assert quartic.convexity == pytest.approx(4.0, abs=1e-6)
    for twist in samples(quartic, 5):
        assert quartic.wrench(twist) == pytest.approx(
            ellipsoid.wrench(twist), rel=1e-10, abs=1e-12
        )
        assert quartic.jacobian(twist) == pytest.approx(
            ellipsoid.jacobian(twist), rel=1e-9, abs=1e-12
        )


def test_fourth_powers_in_closed_form():
    """`x^4 + y^4 + z^4`, nearly: the wrench of a twist is `V^(1/3)` over the 4/3-norm's root."""
    powers = 1e-3 * ELLIPSOID  # strictly convex on the axes too
    powers[(quartic_fit.POWERS == 4).any(axis=1)] += 1.0
    surface = pf.LimitSurfaceQuartic(PATCHES["Square"], coefficients=powers)
    h = surface._direction(np.array([[1.0, 2.0, 3.0]]))[0]
    expected = (
        np.cbrt([1.0, 2.0, 3.0])
        / np.sum(np.array([1.0, 2.0, 3.0]) ** (4.0 / 3.0)) ** 0.25
    )
    assert h == pytest.approx(expected, abs=1e-3)  # the share of the ellipsoid
    along = surface._direction(np.array([[1.0, 0.0, 0.0]]))[0]
    assert along == pytest.approx([1.001**-0.25, 0.0, 0.0], abs=1e-12)


def test_gradients_and_hessians_of_the_monomials():
    """Against differences of complex steps and of gradients."""
    point = np.array([[0.3, -0.7, 1.1]])
    step = 1e-20
    for axis in range(3):
        moved = point.astype(complex)
        moved[0, axis] += 1j * step
        slope = np.prod(moved[:, None, :] ** quartic_fit.POWERS, axis=-1).imag / step
        assert quartic_fit.gradients(point)[..., axis] == pytest.approx(
            slope, rel=1e-14, abs=1e-14
        )
        ends = [
            quartic_fit.gradients(point + side * 1e-5 * np.eye(3)[axis])
            for side in (1.0, -1.0)
        ]
        # central differences of cubic functions: 1e-10 from the third derivative, 1e-11 of rounding
        assert quartic_fit.hessians(point)[..., axis] == pytest.approx(
            (ends[0] - ends[1]) / 2e-5, abs=1e-8
        )


def test_certificate_is_the_hessian():
    matrix = quartic_fit.certificate(KNOWN)
    x, z = np.random.default_rng(2).normal(size=(2, 3))
    y = np.outer(x, z).reshape(9)
    curvature = z @ (quartic_fit.hessians(x[None])[0].transpose(1, 2, 0) @ KNOWN) @ z
    assert y @ matrix @ y == pytest.approx(curvature, rel=1e-12)
    assert np.linalg.eigvalsh(matrix)[0] > 0.0
    # x^4 - 2 x^2 y^2 + y^4 curves inwards along the axes, and no matrix says otherwise
    saddle = np.where((quartic_fit.POWERS == (2, 2, 0)).all(axis=1), -2.0, 0.0)
    saddle += (quartic_fit.POWERS[:, :2] == 4).any(axis=1)
    assert np.linalg.eigvalsh(quartic_fit.certificate(saddle))[0] < -0.1


# ---------------------------------------------------------------------- properties


@names
def test_convex_homogeneous_dissipative(name):
    surface = fitted(name)
    # The constraint, to the solver's tolerance.
    assert surface.convexity >= 0.99 * quartic_fit.MARGIN

    @given(twists, twists, st.floats(1e-3, 1e3))
    @checked
    def check(first, second, scale):
        first, second = np.linalg.solve(
            surface._frame(), np.transpose([first, second])
        ).T
        wrench = surface.wrench(first)
        phi = surface.dissipation(first)
        size = np.array([1.0, 1.0, surface.contact_radius])
        # The direction is found to a slope of 1e-14, over the least curvature of 1e-4.
        assert surface.wrench(scale * first) / size == pytest.approx(
            wrench / size, abs=1e-9
        )
        assert surface.dissipation(scale * first) == pytest.approx(
            scale * phi, rel=1e-9
        )
        assert -wrench @ first == pytest.approx(phi, rel=1e-12)
        assert phi > 0.0
        together = surface.dissipation(first + second)
        assert together <= (phi + surface.dissipation(second)) * (1.0 + 1e-9)
        # maximum dissipation: no other wrench of the surface resists more
        assert -surface.wrench(second) @ first <= phi * (1.0 + 1e-9)

    check()


@names
def test_wrench_and_twist_belong_together(name):
    """Round trip; the wrench is on the surface, wherever the twist."""
    surface = fitted(name)
    twist = samples(surface, 200)
    wrench = surface.wrench(twist)
    h = -np.linalg.solve(surface._frame().T, wrench.T).T
    assert quartic_fit.monomials(h) @ surface.quartic == pytest.approx(
        np.ones(200), rel=1e-12
    )
    back = surface.twist(7.0 * wrench) * surface.dissipation(twist)[:, None]
    # Slope of 1e-14: the gradient comes back to that.
    assert back == pytest.approx(twist, rel=1e-11, abs=1e-11 * np.abs(twist).max())
    assert not surface.wrench(np.zeros(3)).any()


@names
def test_jacobian_is_the_derivative(name):
    """Against central differences: their error is 1e-12 of a third derivative, which NonConvex1's edges make large."""
    surface = fitted(name)
    twist = samples(surface, 20, seed=3)
    assert jacobian_error(surface, twist) < 1e-6
    jacobian = surface.jacobian(twist)
    assert jacobian == pytest.approx(jacobian.transpose(0, 2, 1), rel=1e-9, abs=1e-12)
    assert np.einsum("mij,mj->mi", jacobian, twist) == pytest.approx(
        np.zeros((20, 3)), abs=1e-9
    )


# ---------------------------------------------------------------------- fits


@pytest.mark.parametrize("velocity_weight", [0.0, 1.0])
def test_a_known_quartic_comes_back_from_pairs(velocity_weight):
    known = pf.LimitSurfaceQuartic(FEET, coefficients=KNOWN)
    twist = samples(known, 40, seed=5)
    found = pf.LimitSurfaceQuartic.fit(
        known.wrench(twist), 3.0 * twist, patch=FEET, velocity_weight=velocity_weight
    )
    # Least squares, to rounding.
    assert found.quartic == pytest.approx(KNOWN, rel=1e-9, abs=1e-9)
    # the patch that scales the fit does not shape it
    other = pf.ContactPatch.disc(0.03, cells=5)
    found = pf.LimitSurfaceQuartic.fit(
        known.wrench(twist), twist, patch=other, velocity_weight=velocity_weight
    )
    assert found.wrench(twist) == pytest.approx(known.wrench(twist), rel=1e-7, abs=1e-9)


def test_twists_count():
    """Twists of another surface pull the fit away from the wrenches; with weight 0 they do not."""
    known = pf.LimitSurfaceQuartic(FEET, coefficients=KNOWN)
    ellipsoid = pf.LimitSurfaceEllipsoid(FEET)
    wrench = known.wrench(samples(known, 40))
    pulled, free = (
        pf.LimitSurfaceQuartic.fit(
            wrench, ellipsoid.twist(wrench), patch=FEET, velocity_weight=weight
        ).quartic
        for weight in (1.0, 0.0)
    )
    assert free == pytest.approx(KNOWN, rel=1e-9, abs=1e-9)
    assert np.abs(pulled - KNOWN).max() > 0.05


def test_noise_and_few_pairs_leave_it_convex():
    """Six pairs for 15 numbers, with noise of 20 %: plain least squares is not convex, the fit is."""
    random = np.random.default_rng(9)
    surface = pf.LimitSurfaceCells(FEET)
    twist = samples(surface, 6, seed=6)
    wrench = surface.wrench(twist) * random.normal(1.0, 0.2, size=(6, 3))
    found = pf.LimitSurfaceQuartic.fit(wrench, twist, patch=FEET)
    assert found.convexity >= 0.99 * quartic_fit.MARGIN
    assert (found.dissipation(samples(found, 100)) > 0.0).all()


@pytest.mark.parametrize(
    ("name", "force", "angle"),
    [("Square", 0.3, 0.25), ("Circle", 0.3, 0.25), ("LineGrad", 0.4, 0.5)],
)
def test_better_than_the_ellipsoid(name, force, angle):
    """Errors in force and in velocity, as shares of the ellipsoid's; here 0.25, 0.21 (0.23, 0.18; 0.33, 0.41)."""
    cells = pf.LimitSurfaceCells(PATCHES[name])
    quartic = fitted(name).compare(cells)
    ellipsoid = pf.LimitSurfaceEllipsoid(PATCHES[name]).compare(cells)
    assert quartic.force.rms < force * ellipsoid.force.rms
    assert quartic.angle.rms < angle * ellipsoid.angle.rms
    assert quartic.radius.rms < 0.3 * ellipsoid.radius.rms


def test_follows_the_load():
    """Refitted for each load of a soft finger; given coefficients stay."""
    finger = pf.SoftFinger(c=0.01, k_per_newton=2.0)
    patch = pf.ContactPatch.disc(0.01, cells=15, pressure=finger)
    one, ten = (pf.LimitSurfaceQuartic(patch, normal_force=load) for load in (0.5, 5.0))
    assert np.abs(one.quartic - ten.quartic).max() > 1e-3
    assert one.at(5.0).quartic == pytest.approx(ten.quartic, abs=1e-12)
    given_one = pf.LimitSurfaceQuartic(patch, normal_force=0.5, coefficients=KNOWN)
    assert given_one.at(5.0).quartic == pytest.approx(KNOWN)


def test_stored_for_compiled_models():
    """Compiled loops read the quartic from its table, a model accepts it; nodes twice as dense: errors a quarter."""
    rms = []
    for segments in (10, 20):
        surface = pf.LimitSurfaceQuartic(
            PATCHES["Square"], coefficients=KNOWN, segments=segments
        )
        scaled = np.random.default_rng(7).normal(size=(500, 3))
        u = np.empty_like(scaled)
        numbers = surface.numbers
        kernels.sliding_batch(numbers.kind, numbers.data, 0, numbers.size, scaled, u)
        h = u / np.linalg.norm(scaled, axis=1)[:, None]
        rms.append(np.sqrt(np.mean((h - surface._direction(scaled)) ** 2)))
    assert rms[1] < 1e-3
    assert rms[1] < 0.3 * rms[0]
    law = pf.LuGre(mu_c=1.0, mu_s=1.0, v_s=1e-3, sigma_0=1e5, sigma_1=0.0, sigma_2=0.0)
    assert (
        pf.ReducedModelPublished(PATCHES["Square"], law, surface=surface).surface
        is surface
    )


# ---------------------------------------------------------------------- input


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (
            lambda: pf.LimitSurfaceQuartic(FEET, surface=3),
            "surface must be a limit surface",
        ),
        (
            lambda: pf.LimitSurfaceQuartic(FEET, coefficients=np.ones(14)),
            r"coefficients must have shape \[15\]",
        ),
        (
            lambda: pf.LimitSurfaceQuartic(FEET, coefficients=-KNOWN),
            "coefficients must be those of a convex quartic",
        ),
        (
            lambda: pf.LimitSurfaceQuartic(FEET, segments=1),
            "segments must be an integer >= 2",
        ),
        (
            lambda: pf.LimitSurfaceQuartic.fit(
                np.ones((4, 3)), np.ones((4, 3)), patch=FEET
            ),
            "five or more",
        ),
        (
            lambda: pf.LimitSurfaceQuartic.fit(
                np.ones((6, 3)), np.ones((5, 3)), patch=FEET
            ),
            "as many rows",
        ),
        (
            lambda: pf.LimitSurfaceQuartic.fit(
                np.zeros((6, 3)), np.ones((6, 3)), patch=FEET
            ),
            "wrench must not be zero",
        ),
        (
            lambda: pf.LimitSurfaceQuartic.fit(
                np.ones((6, 3)), np.full((6, 3), np.nan), patch=FEET
            ),
            "twist must be finite",
        ),
        (lambda: fitted("feet").compare(FEET), "reference must be a limit surface"),
        (
            lambda: fitted("feet").compare(fitted("feet"), samples=0),
            "samples must be an integer >= 2",
        ),
    ],
)
def test_errors_are_one_line(act, message):
    with refused(message):
        act()


def test_without_cvxpy(monkeypatch):
    monkeypatch.setitem(sys.modules, "cvxpy", None)
    with refused(r"planarfriction\[quartic\]", MissingExtraError):
        _ = pf.LimitSurfaceQuartic(PATCHES["Square"]).quartic
