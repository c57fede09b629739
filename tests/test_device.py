"""The lateral force device: fixed points, where they change, turns and tangling, against other ways to them."""

import math

import mpmath
import numpy as np
import pytest
from device_reference import in_the_plane, integrate, printed_b_and_c, rhs, scatter
from scipy.optimize import brentq

from towatlas.solve.device import local, model
from towatlas.solve.device.bifurcations import bifurcations
from towatlas.solve.device.model import Device, expand, tension
from towatlas.solve.device.points import points, velocities
from towatlas.solve.device.tangling import Line, tangle
from towatlas.solve.device.turning import turn

INWARD = -0.5 * math.pi
ROUNDING = 1e-12


def kinds(found, kind):
    return [one for one in found if one.kind == kind]


def test_newtons_laws():
    """F and T against the equations of motion with their constraint: the cross term that (13), (14) lack is in."""
    rng = np.random.default_rng(1)
    for k, alpha, R in scatter(100, 2):
        phi, z = rng.uniform(-3, 3), rng.uniform(-2, 2)
        acceleration, T = in_the_plane(k, alpha, R, phi, z)
        scale = (1 + k) * (1 + R + abs(z)) ** 2
        assert rhs(k, alpha, R, phi, z) == pytest.approx(acceleration, abs=ROUNDING * scale)
        u, w = 1 + R * math.sin(phi), R * math.cos(phi)
        assert tension(Device(k, alpha), u, w, z) == pytest.approx(T, abs=ROUNDING * scale)


def test_without_the_cross_term_newtons_laws_fail():
    """Eqs. (13), (14) as printed: the square root of R^2 + 2 L R sin phi + L^2 + (d phi/dt)^2 alone."""
    k, alpha, R, phi, z = 1.0, 0.5, 1.5, 0.3, 0.4
    root = math.sqrt(R**2 + 2 * R * math.sin(phi) + 1 + z**2)
    bracket = z * math.cos(alpha) + R * math.sin(phi - alpha) + math.cos(alpha)
    assert abs(-k * root * bracket + R * math.cos(phi) - in_the_plane(k, alpha, R, phi, z)[0]) > 0.1


def test_derivatives():
    """All of Eq. (25) against differences in 40 digits, B and C against Eqs. (19) and (20) as printed."""
    with mpmath.workdps(40):
        for k, alpha, R in scatter(6, 3):
            for u, w in velocities(Device(k, alpha), R):
                phi = mpmath.atan2(u - 1, w)

                def force(p, z, k=k, alpha=alpha, R=R):
                    U, W = 1 + R * mpmath.sin(p) + z, R * mpmath.cos(p)
                    S = mpmath.sqrt(U * U + W * W)
                    return W - k * S * (mpmath.cos(alpha) * U - mpmath.sin(alpha) * W)

                ours = expand(Device(k, alpha), u, w)
                for name in ("b10", "b01", "b20", "b11", "b02", "b21", "b03"):
                    i, j = int(name[1]), int(name[2])
                    numeric = mpmath.diff(force, (phi, 0), (i, j)) / (mpmath.factorial(i) * mpmath.factorial(j))
                    # R of the point is rounded; third derivatives go with 1/S.
                    scale = (1 + k) * (1 + R) ** 2 / min(1.0, math.hypot(u, w))
                    assert getattr(ours, name) == pytest.approx(float(numeric), rel=1e-11, abs=1e-12 * scale)
                B, C = printed_b_and_c(k, alpha, R, float(phi))
                assert (-ours.b01, -ours.b10) == pytest.approx((B, C), rel=1e-11, abs=1e-12 * (1 + k) * (1 + R) ** 2)


def scanned(k, alpha, R, count=40001):
    """Fixed points by sign changes all round the ship."""
    phi = np.linspace(-math.pi, math.pi, count)
    value = rhs(k, alpha, R, phi, 0.0)
    return [
        brentq(lambda p: rhs(k, alpha, R, p, 0.0), low, high, xtol=1e-15)
        for low, high in zip(phi[:-1][value[:-1] * value[1:] < 0], phi[1:][value[:-1] * value[1:] < 0], strict=True)
    ]


def test_points_are_those_of_a_scan():
    """0, 2 or 4, and each at its place; taut where |phi| < pi/2 alone: above R = 1 one, below none or two."""
    counts = set()
    for k, alpha, R in scatter(250, 4):
        found, other = points(k, alpha, R), scanned(k, alpha, R)
        counts.add(len(found))
        assert len(found) == len(other)
        assert [p.phi for p in found] == pytest.approx(other, abs=1e-9)
        assert [p.physical for p in found] == [abs(p.phi) < 0.5 * math.pi for p in found]
        taut = [p.stable for p in found if p.physical]
        assert len(taut) == 1 if R > 1 else len(taut) in (0, 2)
        if R < 1 and taut:
            assert sorted(taut) == [False, True]
    assert counts == {0, 2, 4}


def test_points_to_rounding():
    for k, alpha, R in scatter(100, 5):
        for p in points(k, alpha, R):
            a, b = math.cos(alpha), math.sin(alpha)
            u, w = 1 + R * math.sin(p.phi), R * math.cos(p.phi)
            terms = abs(w) + k * math.hypot(u, w) * (abs(a * u) + abs(b * w))
            assert abs(rhs(k, alpha, R, p.phi, 0.0)) < 1e-12 * terms + 1e-15 * k * (1 + R) ** 2
            numeric = np.linalg.eigvals(
                [[0, 1], [expand(Device(k, alpha), u, w).b10, expand(Device(k, alpha), u, w).b01]]
            )
            assert sorted(numeric.real) == pytest.approx(sorted(e.real for e in p.eigenvalues), rel=1e-6, abs=1e-8)


@pytest.mark.parametrize("count", [12, pytest.param(200, marks=pytest.mark.slow)])
def test_stability_by_motion(count):
    """Let go 1e-6 beside each fixed point, DOP853: the motion stays where it is stable, and leaves where it is not."""
    for k, alpha, R in scatter(count, 6, k=(-1.0, 1.0)):
        for p in points(k, alpha, R):
            rate = p.eigenvalues[0].real
            # Slower ones take as long as their cycle is small.
            if abs(rate) < 6e-3:
                continue
            time = 12.0 / abs(rate)
            done = integrate(k, alpha, R, (p.phi + 1e-6, 0.0), time, rtol=1e-10, atol=1e-13)
            distance = np.hypot(done.y[0, -1] - p.phi, done.y[1, -1])
            left = np.hypot(done.y[0] - p.phi, done.y[1]).max()
            assert (distance < 1e-7) if p.stable else (left > 1e-4), (k, alpha, R, p)


def test_the_centre():
    """R = 1: the device rests at the centre. (19), (20) are 0/0 there; beside it growth rates tend to +-1."""
    for k, alpha in ((1.0, 0.3), (5.0, -1.4), (0.3, INWARD)):
        (centre,) = [p for p in points(k, alpha, 1.0) if p.phi == INWARD]
        assert not centre.physical
        assert centre.tension == 0.0
        assert [e.real for e in centre.eigenvalues] == [1.0, -1.0]
        with np.errstate(all="ignore"):
            assert not np.isfinite(printed_b_and_c(k, alpha, 1.0, INWARD)).any()
        beside = min(points(k, alpha, 1.0 + 1e-7), key=lambda p: abs(p.phi - INWARD))
        assert [e.real for e in beside.eigenvalues] == pytest.approx([1.0, -1.0], abs=1e-5 * (1 + k))
        assert len(points(k, alpha, 1.0)) in (2, 4)


def test_right_angles():
    for k, R in ((1.0, 1.5), (0.4, 2.0), (3.0, 0.7), (2.0, 3.0)):
        for alpha in (INWARD, -INWARD):
            found = points(k, alpha, R)
            assert [p.phi for p in found] == pytest.approx(scanned(k, alpha, R), abs=1e-9)
            assert not any(p.stable for p in found)
            assert all(e.real == 0.0 for p in found for e in p.eigenvalues if e.imag)
    assert turn(1.0, INWARD).kind == "reversible"
    assert bifurcations(1.0, alpha=INWARD) == ()


# Hopf

PUBLISHED = {
    0.5: (2.454374, 2.45457),
    1.0: (1.585319, 1.58535),
    1.5: (1.324478, 1.32449),
    2.0: (1.207344, 1.20735),
    3.0: (1.105772, 1.10578),
}
KNOWN = {0.5: 2.45458107808, 1.0: 1.58534635367}


@pytest.mark.parametrize("k", [0.03, 0.5, 1.0, 2.0, 3.0, 40.0])
def test_hopf_curve_ends_at_a_third(k):
    """cos alpha_c = 1/3 for every k: there the two Hopf radii of one alpha meet."""
    (limit,) = kinds(bifurcations(k), "hopf-limit")
    assert math.cos(limit.alpha) == pytest.approx(1 / 3, abs=1e-14)
    R = {0.5: 3.50228301594, 1.0: 2.1524388869, 2.0: 1.52200413302, 3.0: 1.3291174802}.get(k, limit.R)
    assert pytest.approx(R, abs=5e-11) == limit.R
    assert limit.physical
    for alpha, count in ((limit.alpha - 1e-6, 2), (limit.alpha + 1e-6, 0)):
        taut = [w for _, w in local.hopf_velocities(Device(k, alpha)) if w > 0]
        assert len(taut) == count


def test_hopf_points_are_crossings_of_the_axis():
    """By bisection on a numeric Jacobian; towards alpha = -pi/2 R tends to 1 + 2/k and sqrt(1 + 1/k^2)."""
    for k in (0.5, 1.0, 4.0):
        for alpha in (-1.3, -1.5):
            for one in kinds(local.at_alpha(Device(k, alpha)), "hopf"):

                def growth(R, one=one, k=k, alpha=alpha):
                    phi = min((p.phi for p in points(k, alpha, R)), key=lambda p: abs(p - one.phi))
                    h = 1e-5
                    return (rhs(k, alpha, R, phi, h) - rhs(k, alpha, R, phi, -h)) / (2 * h)

                span = 1e-3 * one.R
                # Differences of h^2, over the slope of the growth rate.
                assert brentq(growth, one.R - span, one.R + span, xtol=1e-12) == pytest.approx(one.R, abs=1e-8)
                assert (growth(one.R + span) < 0) == (one.stable_side == "above")
        radii = sorted(b.R for b in kinds(local.at_alpha(Device(k, INWARD + 1e-7)), "hopf") if b.physical)
        assert radii == pytest.approx([math.sqrt(1 + 1 / k**2), 1 + 2 / k], abs=1e-5)


@pytest.mark.parametrize("k", PUBLISHED)
def test_degenerate_hopf(k):
    """The printed values but that of k = 0.5, whose last digit is wrong; and Lyapunov's coefficient in 30 digits."""
    (one,) = [b for b in kinds(bifurcations(k), "degenerate-hopf") if b.physical]
    auto, printed = PUBLISHED[k]
    assert pytest.approx(KNOWN.get(k, one.R), abs=6e-12) == one.R
    assert (round(one.R, 5) == printed) == (k != 0.5)
    # AUTO stops short of it, by ten times more at k = 0.5 than elsewhere.
    assert (2.0e-4 if k == 0.5 else 0.0) < one.R - auto < (2.1e-4 if k == 0.5 else 3e-5)
    assert pytest.approx(_radius_without_lyapunov(k, one.R), abs=ROUNDING) == one.R


def _radius_without_lyapunov(k, guess):
    """Root of Kuznetsov's first coefficient, with derivatives by differences."""
    with mpmath.workdps(50):

        def coefficient(R):
            p = mpmath.findroot(
                lambda p: (
                    (-mpmath.sqrt(p**2 + 4) / (k * (1 + p**2)) - 1) ** 2
                    + p**2 * (p**2 + 4) / (k * (1 + p**2)) ** 2
                    - R**2
                ),
                mpmath.mpf(_slope_of(k, guess)),
            )
            u = -mpmath.sqrt(p * p + 4) / (k * (1 + p * p))
            alpha, phi = mpmath.atan((p * p + 2) / p), mpmath.atan2(u - 1, p * u)

            def force(x, z):
                U, W = 1 + R * mpmath.sin(x) + z, R * mpmath.cos(x)
                return W - k * mpmath.sqrt(U * U + W * W) * (mpmath.cos(alpha) * U - mpmath.sin(alpha) * W)

            def d(i, j):
                return mpmath.diff(force, (phi, 0), (i, j))

            # Guckenheimer and Holmes, Eq. (3.4.11), with xi = omega (phi - phi*), eta = z:
            # xi' = omega eta, eta' = -omega xi + g(xi, eta).
            omega = mpmath.sqrt(-d(1, 0))
            gxx, gxy, gyy = d(2, 0) / omega**2, d(1, 1) / omega, d(0, 2)
            gxxy, gyyy = d(2, 1) / omega**2, d(0, 3)
            return (gxxy + gyyy) / 16 + gxy * (gxx + gyy) / (16 * omega)

        return float(mpmath.findroot(coefficient, (guess * (1 + mpmath.mpf("1e-4")), guess * (1 + mpmath.mpf("2e-4")))))


def _slope_of(k, R):
    (one,) = [b for b in kinds(bifurcations(k), "degenerate-hopf") if b.physical]
    assert pytest.approx(R) == one.R
    u = 1 + R * math.sin(one.phi)
    return R * math.cos(one.phi) / u


@pytest.mark.parametrize("k", [0.2, 1.0, 1.9])
def test_takens_bogdanov(k):
    (one,) = kinds(bifurcations(k), "takens-bogdanov")
    assert abs(one.phi) == pytest.approx(math.pi, abs=1e-15)
    assert k**2 * (1 + one.R**2) ** 2 == pytest.approx(one.R**2 + 4, rel=1e-14)
    assert printed_b_and_c(k, one.alpha, one.R, one.phi) == pytest.approx((0, 0), abs=ROUNDING)
    assert one.tension == pytest.approx(-1.0)
    assert not one.physical
    assert not kinds(bifurcations(2.0 + k), "takens-bogdanov")


# Saddle-nodes


def test_saddle_nodes_are_where_the_number_of_points_changes():
    for k, alpha, _ in scatter(60, 8):
        for one in kinds(local.at_alpha(Device(k, alpha)), "saddle-node"):
            # Closer than another one, or than double precision tells two points apart.
            span = 1e-6 * one.R
            below, above = (len(points(k, alpha, one.R + step)) for step in (-span, span))
            assert abs(below - above) == 2
            if one.stable_side:
                R = one.R + (span if one.stable_side == "above" else -span)
                assert any(p.stable for p in points(k, alpha, R) if abs(p.phi - one.phi) < 0.1)


def test_saddle_nodes_both_ways():
    """Those of an alpha, roots along a sheet, and those of a radius, roots of a quartic, are the same points."""
    for k, alpha, _ in scatter(100, 9):
        for kind in ("saddle-node", "hopf", "neutral-saddle"):
            for one in kinds(local.at_alpha(Device(k, alpha)), kind):
                near = [b.alpha for b in kinds(local.at_radius(k, one.R), kind)]
                # Where two of them nearly meet alpha is the root of a difference.
                assert min(abs(other - alpha) for other in near) < 1e-7


def test_cusps():
    """Beyond the corner the slack sheet has no saddle-nodes; on the line of symmetry k^2 G = 1."""
    for k in (0.5, 1.0, 3.0, 50.0):
        cusps = kinds(bifurcations(k), "cusp")
        assert not any(c.physical for c in cusps)
        on_line = sorted(c.R for c in cusps if c.alpha == INWARD)
        assert on_line == pytest.approx(sorted({1 + 1 / k, abs(1 - 1 / k)} - {0.0}), abs=1e-14)
        (corner,) = [c for c in cusps if c.alpha != INWARD]
        for step, count in ((-1e-5, 2), (1e-5, 0)):
            at = [b for b in kinds(local.at_alpha(Device(k, corner.alpha + step)), "saddle-node") if not b.physical]
            assert len(at) == count
            assert all(abs(b.R - corner.R) < 1e-3 for b in at)
    assert (corner.R, corner.alpha) != (0, 0)
    (corner,) = [c for c in kinds(bifurcations(1.0), "cusp") if c.alpha != INWARD]
    assert (corner.R, corner.alpha) == pytest.approx((1.6392467169, -0.873177727331), abs=6e-11)


# Where the paper's methods fail


def test_eliminated_equations_have_solutions_that_are_none():
    """Each root of the quartic fits several phi and alpha, one of them a saddle-node; the Hopf segment is no Hopf."""
    fitting = true = 0
    for k, R in ((1.0, 0.7), (1.0, 1.5), (3.0, 0.9), (0.5, 2.4)):
        for y in local.quartic_roots(k, R):
            u, across = 1.0 - R + R * y, R * math.sqrt(y * (2.0 - y))
            angles = [(local.angle(k, u, w, sheet), w) for w in (across, -across) for sheet in (1, -1)]
            slopes = [abs(expand(Device(k, alpha), u, w).b10) for alpha, w in angles if abs(alpha) < -INWARD]
            fitting += len(slopes)
            true += sum(slope < 1e-7 for slope in slopes)
            assert all(slope < 1e-7 or slope > 1e-2 for slope in slopes)
    assert 0 < true < fitting
    (segment,) = kinds(local.at_alpha(Device(1.0, -1.4)), "neutral-saddle")
    B, C = printed_b_and_c(1.0, -1.4, segment.R, segment.phi)
    assert abs(B) < ROUNDING
    assert C < -0.5
    # Mirror images about alpha = pi/2 solve the squared equations, and push the device along.
    mirrored = math.pi - (-1.4)
    assert abs(printed_b_and_c(1.0, mirrored, segment.R, segment.phi)[0]) > 0.1
    with pytest.raises(ValueError, match="beyond 90 the fluid would push"):
        points(1.0, mirrored - 2 * math.pi, 1.0)


# Turns


@pytest.mark.parametrize(
    ("alpha", "R"), [(-60, 0.573047), (0, 0.574892), (30, 0.453095), (60, 0.252311), (-80, 2.86138)]
)
def test_turns_of_k_one(alpha, R):
    found = turn(1.0, math.radians(alpha))
    assert found.R_min == pytest.approx(R, abs=6e-6 if alpha == -80 else 6e-7)
    assert found.kind == ("hopf" if alpha == -80 else "saddle-node")
    if alpha == -80:
        assert found.ranges[1] == pytest.approx((0.425384, 1.57903), abs=6e-6)


def test_turns_against_points():
    for k, alpha, _ in scatter(60, 10):
        found = turn(k, alpha)
        for R in np.geomspace(0.03, 10.0, 60):
            steady = any(low < R < high for low, high in found.ranges)
            assert steady == any(p.stable and p.physical for p in points(k, alpha, R))


def test_turns_of_strong_devices():
    """k to infinity: 1 for alpha <= 0, cos alpha for alpha > 0."""
    for alpha in (-1.2, -0.4, 0.3, 1.0):
        assert turn(1e5, alpha).R_min == pytest.approx(math.cos(max(alpha, 0.0)), abs=1e-3)


# Tangling


def test_the_two_lines():
    (found,) = tangle(Line(300.0, 60.0, 300.0, 0.9), Line(150.0, 60.0, 300.0, 0.5))
    assert (found.R, found.phi) == pytest.approx((212.302650518, -0.142980989549), abs=6e-10)
    assert found.stable == (True, True)
    assert found.physical
    twice = tangle(Line(300.0, 60.0, 300.0, 0.9), Line(150.0, 60.0, 300.0, 0.5), speed=2.0)
    assert twice[0].tension == pytest.approx([4 * T for T in found.tension], rel=1e-14)


def test_tangles_lie_on_points_of_both_lines():
    rng = np.random.default_rng(11)
    found_some = 0
    for _ in range(12):
        one, other = (
            Line(rng.uniform(50, 400), 10 ** rng.uniform(-0.5, 2), 300.0, rng.uniform(-1.5, 1.5)) for _ in range(2)
        )
        found, mirrored = tangle(one, other), tangle(other, one)
        assert [t.R for t in found] == pytest.approx([t.R for t in mirrored], rel=1e-10)
        for t in found:
            found_some += 1
            for line, T, stable in zip((one, other), t.tension, t.stable, strict=True):
                p = min(
                    points(line.device.k, line.alpha, t.R / line.length),
                    key=lambda p: abs(math.sin(0.5 * (p.phi - t.phi))),
                )
                assert p.phi == pytest.approx(t.phi, abs=1e-8)
                assert p.stable == stable
                assert p.tension * line.mass * line.length / t.R**2 == pytest.approx(T, rel=1e-6)
    assert found_some > 8


def test_strong_devices_tangle_where_the_limit_says():
    one, other = Line(300.0, 1e5, 300.0, 0.9), Line(150.0, 1e5, 300.0, 0.5)

    def bearing(line, R):
        return line.alpha - math.asin(line.length * math.cos(line.alpha) / R)

    R = brentq(lambda R: bearing(one, R) - bearing(other, R), 190.0, 1000.0)
    assert min(abs(t.R - R) for t in tangle(one, other)) < 1e-3


# Bad input


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: points(0.0, 0.1, 1.0), "k must be finite and positive"),
        (lambda: points(1e6, 0.1, 1.0), "are its units right"),
        (lambda: turn(1e-5, 0.1), "are its units right"),
        (lambda: points(1.0, 0.1, 1e-5), "outside 0.0001 to 1e\\+06"),
        (lambda: points(1.0, 1.7, 1.0), "beyond 90 the fluid would push"),
        (lambda: points(1.0, float("nan"), 1.0), "alpha must be finite"),
        (lambda: points(1.0, 0.1, 0.0), "R must be positive"),
        (lambda: points(1.0, 0.1, -2.0), "that of the device with -alpha"),
        (lambda: bifurcations(1.0, alpha=0.1, R=1.0), "got both"),
        (lambda: turn(-1.0, 0.1), "k must be finite and positive"),
        (lambda: tangle(Line(1.0, 1.0, 1.0, 0.1), Line(1.0, 1.0, 1.0, 0.1)), "the two lines are the same"),
        (lambda: tangle(Line(1.0, 1.0, 1.0, INWARD), Line(1.0, 1.0, 1.0, 0.1)), "settles nowhere"),
        (lambda: tangle(Line(0.0, 1.0, 1.0, 0.2), Line(1.0, 1.0, 1.0, 0.1)), "length must be finite and positive"),
    ],
)
def test_bad_input(call, said):
    with pytest.raises(ValueError, match=said):
        call()


def test_a_right_angle_is_exactly_one():
    assert Device(1.0, model.RIGHT_ANGLE).a == 0.0
