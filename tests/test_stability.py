"""Growth rates: closed forms and known values, folds, symmetries, two methods, and where methods fail."""

import json
import sys

import numpy as np
import pytest
from helpers import run

import towatlas
from towatlas.kernels import status
from towatlas.solve.galerkin import matrices, modes
from towatlas.solve.growth import reach_of
from towatlas.solve.motion import motions
from towatlas.solve.spectrum import polish, together
from towatlas.solve.stability import spectrum_of
from towatlas.solve.winding import count_growing

AIR = {"C": 0.018}
WATER = {"C": 50.0, "w": 0.55, "m_f": 0.3, "C_f": 0.5, "C_t": 1.0}


def motion_of(found, k, reach=None, bound=1.5):
    speed = found.gamma
    reach = reach or reach_of(found.system, speed)
    return motions(found.r_f[k : k + 1], np.array([speed]), found.system.row()[None], reach, bound)[0]


def galerkin(motion, degree, panel):
    """Eigenvalues of Galerkin's method by itself."""
    mass, friction, stiffness = matrices(motion, degree, panel)
    # Functions on short panels weigh little: rounding is kept small by scales, and the mass as unit.
    scale = 1.0 / np.sqrt(np.diag(mass))
    mass, friction, stiffness = (scale[:, None] * part * scale for part in (mass, friction, stiffness))
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    friction, stiffness = inverse @ friction @ inverse.T, inverse @ stiffness @ inverse.T
    size = len(mass)
    return np.linalg.eigvals(np.block([[np.zeros((size, size)), np.eye(size)], [-stiffness, -friction]]))


# From independent codes: Galerkin with one panel, and a chain of rigid links.
KNOWN = [
    ((2.5, 0.0, 2.534), {}, "1 inner", 0.2218, 1.3277, 5e-5),
    ((37.8, 1352.0, 5.94), {}, "2 inner", 0.29865, 2.54164, 5e-6),
    ((10.0, 1352.0, 15.7598), {}, "2 inner", 7.739, 0.0, 5e-4),
    ((37.8, 1352.0, 5.94), AIR, "shape 1", 0.152220, 2.56185, 5e-6),
    ((37.8, 1352.0, 3.9), AIR, "shape 1", 0.13986, 1.54968, 5e-6),
    ((52.4, 1352.0, 4.77), AIR, "shape 1", 0.0878, 0.54205, 5e-5),
    ((52.4, 1352.0, 2.46), AIR, "shape 1", 0.0104, None, 5e-5),
    ((52.4, 1571.0, 2.60), AIR, "shape 1", 0.0406, None, 5e-5),
    ((52.4, 1571.0, 7.23), AIR, "shape 1", 0.1277, None, 5e-5),
    ((3.0, 0.2, 0.05), {"C": 50.0, "w": 0.55, "m_f": 0.3}, "shape 1", -0.1152875169, 0.0298835005, 1e-9),
]


@pytest.mark.parametrize(("cable", "fluid", "branch", "growth", "frequency", "digits"), KNOWN)
def test_known_growth_rates(cable, fluid, branch, growth, frequency, digits):
    found = towatlas.stability(*cable, **fluid)
    k = list(found.equilibria.branch).index(branch)
    assert found.status[k] == status.OK
    assert found.growth[k] == pytest.approx(growth, abs=digits)
    if frequency is not None:
        assert found.frequency[k] == pytest.approx(frequency, abs=10 * digits)


def test_photographed_shapes_that_are_stable():
    for cable in ((37.8, 1352.0, 1.64), (37.8, 1352.0, 2.97), (52.4, 1571.0, 4.77)):
        found = towatlas.stability(*cable, **AIR)
        assert found.kind[found.equilibria.expected] == "stable", cable


def pendulum(lam, gamma):
    """Growth rates of a conical pendulum: a heavy fish on a straight cable; the root next to the axis."""
    # Of tan(theta) = gamma^2 (1 + lam sin(theta)) with the fish beyond the axis.
    theta = np.linspace(-np.pi / 2 + 1e-9, -1e-9, 400001)
    miss = np.tan(theta) - gamma**2 * (1.0 + lam * np.sin(theta))
    k = np.flatnonzero((miss[1:] > 0) != (miss[:-1] > 0))[-1]
    low, high = theta[k], theta[k + 1]
    for _ in range(60):
        middle = 0.5 * (low + high)
        value = np.tan(middle) - gamma**2 * (1.0 + lam * np.sin(middle))
        low, high = (middle, high) if (value > 0) == (miss[k] > 0) else (low, middle)
    c, g2 = np.cos(low), gamma**2
    a = 1.0 / (lam * c)
    first, second = a - g2 * c**2, a - g2
    squares = np.roots([1.0, first + second + 4.0 * g2 * c**2, first * second])
    rates = np.sqrt(squares.astype(complex))
    return max(np.abs(rates.real)), rates


@pytest.mark.parametrize(("lam", "onset"), [(1.6, 2.1279247774), (2.5, 2.1705472670), (4.0, 2.7949881921)])
def test_conical_pendulum(lam, onset):
    for gamma in (0.998 * onset, 1.03 * onset, 1.3 * onset):
        expected, _ = pendulum(lam, gamma)
        errors = []
        for w_f in (1e5, 1e6):
            found = towatlas.stability(lam, w_f, gamma)
            k = list(found.equilibria.branch).index("1 inner")
            assert (found.kind[k] == "stable") == (gamma < onset)
            errors.append(abs(found.growth[k] - expected))
        # The cable's own mass, over that of the fish, is left out in the closed form.
        assert errors[1] <= 0.11 * errors[0] + 1e-12
        assert errors[0] < 1e-4


@pytest.mark.parametrize(
    ("cable", "fluid", "speeds"),
    [((37.8, 1352.0), {}, (0.1, 4.0)), ((16.0, 3.0), {"C": 5.6}, (1.0, 6.0)), ((10.0, 0.5), {}, (0.2, 4.0))],
)
def test_a_growth_rate_is_zero_at_every_fold(cable, fluid, speeds):
    folds = towatlas.folds(*cable, gamma=speeds, **fluid)
    assert len(folds.value) >= 2
    system = towatlas.System.of(*cable, **fluid)
    for r_f, gamma in zip(folds.r_f, folds.gamma, strict=True):
        motion = motions(np.array([r_f]), np.array([gamma]), system.row()[None], 1.0)[0]
        values, logs = motion.evans(np.array([0.0, 0.1, 0.1j]))
        sizes = np.abs(values) * np.exp(logs - logs.max())
        # Rounding of the fold's own offset, which a determinant sees as the distance of two shapes.
        assert sizes[0] < 1e-9 * sizes[1:].max()


def test_next_to_a_fold_without_drag_growth_is_as_the_fourth_root_of_the_distance():
    """The stiffness goes like the square root, and the square of the growth rate like the stiffness."""
    critical = float(towatlas.solve_critical(37.8, 1352.0, 1).gamma)
    powers = []
    for distance in (1e-5, 1e-6, 1e-7):
        found = towatlas.stability(37.8, 1352.0, critical * (1.0 + distance))
        outer = list(found.equilibria.branch).index("1 outer")
        inner = list(found.equilibria.branch).index("1 inner")
        assert found.unstable[outer] == 1
        powers.append([found.growth[outer] ** 4 / distance, found.frequency[inner] ** 4 / distance])
    powers = np.array(powers)
    # Both members the same in the limit, corrections as the square root of the distance.
    apart = np.abs(powers[:, 0] / powers[:, 1] - 1.0)
    assert apart[2] < 0.01
    np.testing.assert_allclose(apart[1:] / apart[:-1], 10.0**-0.5, rtol=0.1)


def test_next_to_a_fold_with_drag_growth_is_as_the_square_root_of_the_distance():
    folds = towatlas.folds(10.0, 1.0, gamma=(0.2, 2.0), C=0.03)
    critical, r_f = folds.gamma[0], folds.r_f[0]
    powers = []
    for distance in (1e-8, 1e-9, 1e-10):
        found = towatlas.stability(10.0, 1.0, critical * (1.0 + distance), C=0.03)
        near = np.argsort(np.abs(found.equilibria.r_f - r_f))[:2]
        growth = found.growth[near]
        assert sorted(found.unstable[near]) == [0, 1]
        powers.append(np.sort(growth**2 / distance))
    powers = np.array(powers)
    apart = powers[:, 1] / powers[:, 0] - 1.0
    assert apart[2] < 0.05
    np.testing.assert_allclose(apart[1:] / apart[:-1], 10.0**-0.5, rtol=0.1)


def test_two_methods_agree():
    for cable, fluid, digits in (
        ((37.8, 1352.0, 5.94), {}, 2e-12),
        ((3.0, 0.2, 0.3), WATER, 2e-12),
        # Galerkin's method begins 1e-9 of the cable above its tip.
        ((10.0, 0.0, 4.0), {}, 2e-9),
        # |V_n| has a kink where the cable passes the axis, in the middle of a panel.
        ((10.0, 1.0, 1.5), {"C": 0.03}, 1e-5),
        ((6.0, 20.0, 2.0), {"C": 0.1, "C_f": 0.2, "C_t": 0.01}, 1e-5),
    ):
        found = towatlas.stability(*cable, **fluid)
        for k in range(len(found)):
            leading = found.eigenvalues[k][0] / abs(found.equilibria.gamma)
            difference = np.abs(galerkin(motion_of(found.equilibria, k), 11, 3.0) - leading).min()
            assert difference < digits, (cable, k)


def test_steps_twice_as_short_change_nothing():
    for cable, fluid in (((37.8, 1352.0, 5.94), AIR), ((10.0, 0.0, 10.0), {}), ((3.0, 0.2, 0.3), WATER)):
        found = towatlas.stability(*cable, **fluid)
        for k in range(len(found)):
            leading = found.eigenvalues[k][:1] / abs(found.equilibria.gamma)
            roots, good = polish(motion_of(found.equilibria, k, bound=0.7), leading, leading)
            assert good.all()
            assert np.abs(roots.sigma - leading).max() < 1e-12, (cable, k)


def test_layers_at_high_speed_are_resolved():
    """The steps of a shot keep its force, but not the direction of a cable that turns within a layer: those of the
    motion are shorter there. Against 19 digits, and against steps so short that they resolve it anyway."""
    found = towatlas.equilibria(10.0, 1.0, 8.0)
    leading = towatlas.stability_of(found).eigenvalues[found.expected][0] / found.gamma
    # docs/data/reference_stability.csv.
    assert abs(leading - (0.084635044324686284 + 0.69785036709449266j)) < 1e-13
    found = towatlas.stability(10.0, 0.0, 10.0)
    for k in range(len(found)):
        leading = found.eigenvalues[k][:1] / found.equilibria.gamma
        roots, good = polish(motion_of(found.equilibria, k, bound=0.2), leading, leading)
        assert good.all()
        assert np.abs(roots.sigma - leading).max() < 1e-13, k


def differences(function, small=1e-6):
    """Central ones, a column an axis."""
    steps = small * np.eye(3)
    return np.stack([(function(step) - function(-step)) / (2.0 * small) for step in steps], axis=1)


def test_drag_is_linearised_as_differences_of_it_say():
    found = towatlas.equilibria(6.0, 2.0, 1.5, C=0.3, C_f=0.2, C_t=0.05)
    for k in range(len(found)):
        motion = motion_of(found, k)
        g2, system = found.gamma**2, found.system
        r = found.r_f[k] * g2
        force = np.array([g2 * system.m_f * r, -system.C_f * r * r, g2 * system.w_f])
        tension, T_A, E_P = motion.series[0, 0, 0], motion.series[0, 0, 10:19], motion.series[0, 0, 19:28]
        t, U = force / np.linalg.norm(force), np.array([0.0, r, 0.0])
        P = np.eye(3) - np.outer(t, t)

        def drag(U, t, C=system.C / g2, C_t=system.C_t / g2):
            along = U @ t
            across = U - along * t
            return -C * np.linalg.norm(across) * across - C_t * abs(along) * along * t

        by_speed = differences(lambda d, U=U, t=t, drag=drag: drag(U + d, t))
        by_turn = differences(lambda d, U=U, t=t, P=P, drag=drag: drag(U, t + P @ d))
        assert tension == pytest.approx(np.linalg.norm(force), rel=1e-14)
        # Of central differences.
        np.testing.assert_allclose(T_A.reshape(3, 3), -tension * by_speed, atol=1e-8 * np.abs(T_A).max())
        np.testing.assert_allclose(E_P.reshape(3, 3), by_turn, atol=1e-8 * np.abs(E_P).max())
        A = T_A.reshape(3, 3)
        np.testing.assert_allclose(A, A.T, atol=1e-14 * np.abs(A).max())
        assert np.linalg.eigvalsh(A).min() > -1e-14 * np.abs(A).max()


def test_without_drag_growth_rates_come_in_quadruples():
    found = towatlas.equilibria(10.0, 1.0, 2.0)
    sigma = np.array([0.3 + 0.4j, -0.3 + 0.4j, 0.3 - 0.4j, -0.3 - 0.4j])
    for k in range(len(found)):
        values, logs = motion_of(found, k).evans(sigma)
        D = values * np.exp(logs - logs[0])
        # D is even, and real on the real axis.
        np.testing.assert_allclose(D, [D[0], D[0].conj(), D[0].conj(), D[0]], rtol=1e-11)


@pytest.mark.parametrize("drag", [0.0, 0.05, 0.5])
def test_what_is_beside_a_point_and_terms_below_rounding_do_not_matter(drag, monkeypatch):
    found = towatlas.equilibria(20.0, 10.0, 2.0, C=drag)
    rng = np.random.default_rng(21)
    for k in range(len(found)):
        motion = motion_of(found, k)
        sigma = rng.normal(0.0, 0.5, 7) + 1j * rng.uniform(0.0, motion.reach, 7)
        values, logs = motion.evans(sigma)
        for count in range(1, 7):
            for first in range(7 - count):
                some = slice(first, first + count)
                both = motion.evans(sigma[some])
                np.testing.assert_array_equal(both[0], values[some])
                np.testing.assert_array_equal(both[1], logs[some])
        with monkeypatch.context() as patch:
            patch.setattr("towatlas.solve.motion.SMALL", 0.0)
            whole, whole_logs = motion.evans(sigma)
        np.testing.assert_allclose(values * np.exp(logs - whole_logs), whole, rtol=1e-11, atol=0.0)


def test_mirror_images_have_the_same_growth_rates():
    for other in (
        towatlas.stability(6.0, 2.0, -1.5, C=0.3),
        towatlas.stability(6.0, -2.0, 1.5, C=0.3, w=-0.999999999999, m_f=2.0),
    ):
        found = towatlas.stability(6.0, 2.0, 1.5, C=0.3)
        order = np.argsort(other.equilibria.r_f)
        mine = np.argsort(found.equilibria.r_f)
        np.testing.assert_allclose(other.growth[order], found.growth[mine], rtol=1e-9, atol=1e-9)
        assert list(other.kind[order]) == list(found.kind[mine])


def test_every_shape_in_a_vacuum_is_accounted_for():
    rng = np.random.default_rng(14)
    shapes = 0
    while shapes < 60:
        lam, gamma = 10.0 ** rng.uniform(-0.3, 1.6), 10.0 ** rng.uniform(-0.8, 1.0)
        w_f = 0.0 if rng.random() < 0.2 else 10.0 ** rng.uniform(-3.0, 4.0)
        equilibria = towatlas.equilibria(lam, w_f, gamma)
        if len(equilibria) > 9:
            continue
        found = towatlas.stability_of(equilibria)
        shapes += len(found)
        assert (found.status == status.OK).all(), (lam, w_f, gamma)
        # Theorem: outward shapes are stable, outer members are not; and what grows has the parity of the index.
        for k, branch in enumerate(equilibria.branch):
            assert found.unstable[k] <= found.index[k]
            assert (found.index[k] - found.unstable[k]) % 2 == 0
            if branch == "outward":
                assert found.kind[k] == "stable"
            elif branch.endswith("outer"):
                assert found.unstable[k] > 0
                assert 0.0 < found.growth[k] < gamma


def test_no_drag_is_the_limit_of_little():
    vacuum = towatlas.stability(2.5, 1.0, 2.5)
    air = towatlas.stability(2.5, 1.0, 2.5, C=1e-9)
    order = np.argsort(vacuum.equilibria.r_f)
    np.testing.assert_allclose(air.growth[np.argsort(air.equilibria.r_f)], vacuum.growth[order], atol=1e-7)


class TestWhereMethodsFail:
    def test_double_roots(self):
        """At a collision secants find no root to full accuracy; the sum and the product of the two stay accurate."""
        low, high = 3.64, 3.65  # the median shape of (37.8, 1352) stops growing between these
        squares = []
        for gamma in np.linspace(low, high, 5):
            found = towatlas.equilibria(37.8, 1352.0, gamma)
            motion = motion_of(found, found.expected)
            guesses = modes(motion)
            turning = guesses.sigma[(np.abs(guesses.sigma) < 1.0) & (guesses.sigma.imag > 0.0)]
            apart = np.abs(turning[:, None] - turning) + np.eye(len(turning)) * 9.0
            one, other = np.unravel_index(np.argmin(apart), apart.shape)
            centre = 1j * (0.5 * (turning[one] + turning[other])).imag
            roots = together(motion, centre, 0.1)
            near = roots.sigma[np.argsort(np.abs(roots.sigma - centre))[:2]]
            squares.append(((near[0] - near[1]) / 2.0) ** 2)
        squares = np.array(squares)
        assert squares[0].real > 0.0 > squares[-1].real
        # Smooth in the speed: a parabola through all but the middle one gives that one.
        others = [0, 1, 3, 4]
        fitted = np.polyval(np.polyfit(np.arange(5)[others], squares.real[others], 3), 2)
        assert fitted == pytest.approx(squares.real[2], abs=1e-9)

    def test_secants_go_to_a_neighbour(self):
        """A guess half way between two zeros is given up, not followed to one of them."""
        found = towatlas.equilibria(37.8, 1352.0, 5.94, **AIR)
        motion = motion_of(found, 1)
        roots, good = polish(motion, np.array([0.0 + 0.99j]), np.array([0.0 + 0.99j]))
        assert not good[0] or np.abs(roots.sigma[0] - 0.99j) < 0.25

    def test_phases_alone_alias(self):
        """Two zeros close beside the contour turn the phase by 2 pi between two of evenly spaced points."""
        found = towatlas.stability(52.4, 1352.0, 4.77, **AIR)
        motion = motion_of(found.equilibria, 1)
        all_known = found.eigenvalues[1] / found.equilibria.gamma
        assert count_growing(motion, all_known) == 2
        # Points by hand, none of the zeros taken out.
        coarse = []
        for points in (12, 4000):
            t = np.linspace(0.0, 2.0, points)
            R = motion.reach
            sigma = np.where(t <= 1.0, R * np.exp(0.5j * np.pi * np.minimum(t, 1.0)), 1j * R * np.maximum(2.0 - t, 0.0))
            values, _ = motion.evans(sigma)
            coarse.append(np.angle(values[1:] / values[:-1]).sum() / np.pi)
        assert round(coarse[1]) == 2
        assert round(coarse[0]) != 2
        # Without a single one known.
        assert count_growing(motion, np.empty(0, complex)) == 2

    def test_galerkin_has_growing_modes_that_are_none(self):
        """In drag so strong that the kink of |V_n| rules, a guess grows and no zero of the Evans function does."""
        found = towatlas.stability(2.827946046880704, 0.011964874005717096, 0.06643974164883068, C=5442.322564166111)
        motion = motion_of(found.equilibria, 0)
        assert modes(motion).sigma.real.max() > 1.0
        assert found.unstable[0] == 0
        assert found.kind[0] == "stable"

    def test_few_panels_at_high_speed(self):
        """Layers next to the nodes, where all of the turn is: one panel sees none of them."""
        found = towatlas.stability(10.0, 0.0, 10.0)
        k = list(found.equilibria.branch).index("4 inner")
        leading = found.eigenvalues[k][0] / found.equilibria.gamma
        motion = motion_of(found.equilibria, k)
        assert np.abs(galerkin(motion, 24, 1e9) - leading).min() > 1e-3
        assert np.abs(galerkin(motion, 8, 4.0) - leading).min() < 1e-5

    def test_a_bare_end_in_drag_is_not_counted(self):
        found = towatlas.stability(5.0, 0.0, 1.0, C=0.5)
        assert (found.status == status.FLOW_OUTRUNS_WAVES).all()
        assert (found.unstable == -1).all()
        assert (found.kind == "unknown").all()
        assert "bare end" in found.sentence(0)


def test_a_side_force_turns_with_the_turn():
    """To port it is what its opposite is to starboard; with none it is the limit of little."""
    fluid = {"C": 1.0, "C_t": 0.02, "b_s": 0.2}
    starboard = towatlas.stability(3.0, 0.2, 0.3, C_s=0.1, **fluid)
    port = towatlas.stability(3.0, 0.2, -0.3, C_s=-0.1, **fluid)
    other = towatlas.stability(3.0, 0.2, 0.3, C_s=-0.1, **fluid)
    np.testing.assert_allclose(port.growth, starboard.growth, rtol=1e-10)
    assert abs(other.growth[0] / starboard.growth[0] - 1.0) > 1e-3
    none = towatlas.stability(3.0, 0.2, 0.3, **fluid)
    little = towatlas.stability(3.0, 0.2, 0.3, C_s=1e-8, **fluid)
    np.testing.assert_allclose(little.growth, none.growth, rtol=1e-6)


class TestCommand:
    def test_table_and_json(self, capsys):
        code, out, err = run(capsys, "stability", "--lam=37.8", "--wf=1352", "--gamma=5.94", "--C=0.018", "--json")
        rows = json.loads(out)
        assert code == 0
        assert [row["kind"] for row in rows] == ["divergence", "flutter", "stable"]
        keys = ["R_x0", "r_f", "nodes", "growth", "frequency", "unstable", "index", "kind", "error", "status"]
        assert all(key in rows[0] for key in keys)
        assert "not proved" in err
        code, out, _ = run(capsys, "stability", "--lam=37.8", "--wf=1352", "--gamma=5.94", "--C=0.018")
        assert "flutter" in out.splitlines()[2]

    def test_what_patience_allows_for(self, capsys, monkeypatch):
        """The shape that is expected first, then few nodes; what is left over is said once, and the exit code."""
        done = []

        def some(found, k, motion):
            if len(done) == 2:
                raise towatlas.TooMuchWork("over")
            done.append(k)
            return spectrum_of(found, k, motion)

        monkeypatch.setattr(sys.modules["towatlas.solve.stability"], "spectrum_of", some)
        ask = ("stability", "--lam", 37.8, "--wf", 1352, "--gamma", 5.94, "--json")
        code, out, said = run(capsys, *ask)
        rows = json.loads(out)
        assert code == 1
        assert done == [2, 4]
        assert [row["status"] for row in rows] == ["unfinished", "unfinished", "computed", "unfinished", "computed"]
        assert rows[2]["kind"] == "flutter"
        assert said.count("not finished within the patience") == 1
        assert "of 3 of 5 shapes none was looked for" in said
        code, out, said = run(capsys, *ask)
        assert (code, out, "over" in said) == (1, "", True)

    def test_motions_of_many_shapes_are_not_made_at_once(self, monkeypatch):
        """Those of thousands take longer than the patience, and more memory than there is."""
        found, made = towatlas.equilibria(12.0, 0.01, 8.0), []

        def some(r_f, *rest):
            made.append(len(r_f))
            return motions(r_f, *rest)

        monkeypatch.setattr(sys.modules["towatlas.solve.stability"], "motions", some)
        answer = towatlas.stability_of(found)
        assert (answer.status == status.OK).all()
        assert len(found) > 8
        assert made == [8] * (len(found) // 8) + [len(found) % 8] * (len(found) % 8 > 0)

    def test_what_is_refused(self, capsys):
        assert run(capsys, "stability", "--lam=-3", "--wf=0.2", "--gamma=0.3")[0] == 2
