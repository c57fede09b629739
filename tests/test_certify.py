"""Proofs hold what is computed independently, and refuse what is wrong."""

import copy
import csv
import dataclasses
import json
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from flint import fmpz_poly
from helpers import SMALL_GRID, random_cables
from reference_proof import polished

from towatlas import certify, certify_equilibria, equilibria, solve_critical
from towatlas.builders.certified import certify_atlas
from towatlas.builders.critical import build_atlas
from towatlas.builders.grids import ScanSettings
from towatlas.cli import main
from towatlas.solve.proof.arithmetic import Refused, binary, working_bits
from towatlas.solve.proof.certificates import CERTIFIED, NO_TRANSITION, answer, no_transition
from towatlas.solve.proof.chain import Chain
from towatlas.solve.proof.finding import find_chain
from towatlas.solve.proof.index import zeros
from towatlas.solve.proof.krawczyk import Claim, prove, verify
from towatlas.tables.certified import read_certified
from towatlas.tables.seal import AtlasFileError

REFERENCES = Path(__file__).parent.parent / "docs" / "data"
QUICK = [(37.8, 1352.0, 2), (10.0, 0.0, 1)]
MORE = [
    (10.0, 0.0, 2),
    (2.5, 0.0, 1),
    (300.0, 0.0, 4),
    (7.3, 0.25, 3),
    (1.5, 8.0, 1),
    (50.0, 1e-3, 2),
    (12.5, 0.1, 5),
    (900.0, 30.0, 6),
    (20.0, 1e4, 6),
    (2.01, 1.0, 1),
]


def chain_about(lam, w_f, n, bits=133, order=60) -> Chain:
    state = solve_critical(lam, w_f, n)
    gamma = float(state.gamma)
    with working_bits(bits + 64):
        a = abs(float(state.x_f)) * gamma**2
        return find_chain(lam=lam, w_f=w_f, gamma=gamma, n=n, a=a, bits=bits, order=order)[0]


@pytest.fixture(scope="module")
def proved():
    chain = chain_about(37.8, 1352.0, 2)
    return chain, *prove(chain)


@pytest.mark.parametrize("cable", [*QUICK, *(pytest.param(cable, marks=pytest.mark.slow) for cable in MORE)])
def test_an_independent_integration_lies_in_the_enclosures(cable):
    lam, w_f, n = cable
    found = certify(lam, w_f, n)
    assert (found.status, found.n_proved, found.unique) == (CERTIFIED, True, "by theorem")
    with mp.workdps(45):
        values = polished(n, lam, w_f, found.gamma, found.x_f)
        # One step from 30 digits leaves the rounding of 45-digit shots, times what the fold does to it.
        for name, value in zip(("gamma", "R_x0", "x_f"), values, strict=True):
            radius = mp.mpf(getattr(found, name + "_radius"))
            assert abs(value - mp.mpf(getattr(found, name))) <= radius + mp.mpf(10) ** -38 * abs(value)
            assert radius < mp.mpf(10) ** -26 * abs(value)


def test_reference_folds_agree():
    """Two computations of the same numbers; the references have 34 digits."""
    with (REFERENCES / "reference_folds.csv").open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    for row in rows[:6]:
        found = certify(float(row["lam"]), float(row["w_f"]), int(row["n"]), digits=30)
        assert found.status == CERTIFIED
        away = abs(Fraction(found.gamma) - Fraction(row["gamma"]))
        # What is printed of each is rounded.
        assert away <= Fraction(found.gamma_radius) + Fraction(row["gamma"]) / 10**33


def _certified(rows):
    n, w_f, lam = random_cables(rows, seed=7)
    states = solve_critical(lam, w_f, n)
    for k in range(rows):
        found = certify(lam[k], w_f[k], int(n[k]), digits=16)
        assert found.status == CERTIFIED, (n[k], w_f[k], lam[k])
        off = abs(Fraction(found.gamma) - Fraction(float(states.gamma[k]))) + Fraction(found.gamma_radius)
        assert off <= states.error[k] * states.gamma[k]


def test_some_random_cables_are_certified_and_stated_errors_hold():
    _certified(3)


@pytest.mark.slow
def test_random_cables_are_certified_and_stated_errors_hold():
    _certified(20)


def test_the_printed_root_of_the_report_is_none():
    """R_x0 = 3.79886 is printed for w_f = 0, lambda = 2, gamma = 1; what is printed may be off by half a unit."""
    found = certify_equilibria(2.0, 0.0, 1.0)
    assert (found.status, found.passed, len(found.states)) == (CERTIFIED, 0, 1)
    root = found.states[0]
    assert abs(Fraction(root.R_x0) - Fraction("3.79886")) - Fraction(root.R_x0_radius) > Fraction("0.000005")


@pytest.mark.parametrize("system", [(37.8, 1352.0, 5.94), pytest.param((10.0, 0.0, 4.0), marks=pytest.mark.slow)])
def test_all_equilibria_are_proved(system):
    found, solved = certify_equilibria(*system), equilibria(*system)
    assert found.status == CERTIFIED
    assert [state.branch for state in found.states] == solved.branch.tolist()
    for state, x_f in zip(found.states, solved.x_f, strict=True):
        # As accurate as the solver states, and the rounding of the forces of fast cables.
        assert float(state.x_f) == pytest.approx(x_f, rel=1e-9)


def test_a_speed_at_a_fold_is_refused():
    gamma = float(certify(10.0, 1.0, 1).gamma)
    assert certify_equilibria(10.0, 1.0, gamma).status != CERTIFIED


def test_more_digits_come_when_asked_for():
    found = certify(37.8, 1352.0, 2, digits=80)
    assert Fraction(found.gamma_radius) < Fraction(1, 10**80)
    few = certify(37.8, 1352.0, 2)
    assert abs(Fraction(found.gamma) - Fraction(few.gamma)) <= Fraction(few.gamma_radius) + Fraction(found.gamma_radius)


def test_shrunken_boxes_are_refused(proved):
    chain, claim, _ = proved
    verify(chain, claim)
    for small in (
        Claim(claim.tails, [r / 16 for r in claim.unknowns], claim.nodes),
        Claim(claim.tails, claim.unknowns, [[r / 16 for r in node] for node in claim.nodes]),
        Claim(claim.tails, claim.unknowns, [*claim.nodes[:-1], [r / 16 for r in claim.nodes[-1]]]),
    ):
        with pytest.raises(Refused, match="does not map the box into itself"):
            verify(chain, small)


def test_halved_tails_are_refused(proved):
    chain, claim, _ = proved
    for which in (0, 1):
        tails = [tuple(tail / 2 if i == which else tail for i, tail in enumerate(pair)) for pair in claim.tails]
        with pytest.raises(Refused, match="tail of step 0 is larger"):
            verify(chain, Claim(tails, claim.unknowns, claim.nodes))


@pytest.mark.parametrize("place", ["a", "G", "node", "coefficient", "column", "length"])
def test_perturbed_centres_are_refused(proved, place):
    """By a few units of the radius; by 1e-4 where the proof needs a good Jacobian only."""
    chain, claim, _ = proved
    wrong = copy.copy(chain)
    wrong.steps = [copy.copy(step) for step in chain.steps]
    step = wrong.steps[3] = copy.copy(chain.steps[3])
    step.x, step.v = list(step.x), [list(column) for column in step.v]
    if place in "aG":
        mantissa, power = getattr(chain, place)
        units = claim.unknowns["aG".index(place)] * binary(1, -power)
        setattr(wrong, place, (mantissa + 8 * int(units.ceil().unique_fmpz()), power))
    elif place == "node":
        step.x[0] = step.x[0] + (1 << 40)
    elif place == "coefficient":
        step.x[1] = step.x[1] + fmpz_poly([0, 0, 0, 1 << 40])
    elif place == "column":
        step.v[0][0] = step.v[0][0] + fmpz_poly([0, 1 << 50])
    else:
        wrong.steps[3].h = (step.h[0] + 1, step.h[1])
    with pytest.raises(Refused):
        verify(wrong, claim)


def test_a_wrong_number_is_refused(proved):
    """The first fold offered as the third: same sign, same conditions, another count of zeros."""
    chain = chain_about(16.0, 3.0, 1)
    claim, steps = prove(chain)
    assert zeros(chain, claim, steps) == 1
    chain.n = 3
    claim, steps = prove(chain)
    with pytest.raises(Refused, match="this fold has index 1, not 3") as refused:
        answer(chain, claim, steps, 20)
    assert refused.value.status == "NOT_ISOLATED"
    chain, *_ = proved
    other = copy.copy(chain)
    other.n = 1
    with pytest.raises(Refused):
        prove(other)


def test_columns_that_begin_as_no_derivatives_are_refused(proved):
    chain, claim, _ = proved
    wrong = copy.copy(chain)
    wrong.steps = [copy.copy(step) for step in chain.steps]
    wrong.steps[2].w = [list(column) for column in chain.steps[2].w]
    wrong.steps[2].w[1][1] = chain.steps[2].w[1][1] + 1
    with pytest.raises(Refused, match="do not begin as derivatives do"):
        verify(wrong, claim)


@pytest.mark.parametrize(("w_f", "threshold"), [(0.0, 2.0), (0.75, 1.5)])
def test_no_transition_is_proved_up_to_the_threshold_itself(w_f, threshold):
    """Thresholds that are binary fractions: sqrt(1 + w_f^2) = 1 and 1.25."""
    for n in (1, 2, 40):
        lam = threshold + 2 * (n - 1)
        assert no_transition(lam=lam, w_f=w_f, n=n)
        assert not no_transition(lam=np.nextafter(lam, 99.0), w_f=w_f, n=n)
    found = certify(threshold, w_f, 1)
    assert (found.status, found.gamma, found.n_proved, found.unique) == (NO_TRANSITION, None, True, None)


def test_bad_numbers_are_refused():
    for arguments, match in [
        ({"lam": -1.0, "w_f": 1.0}, "lam must be finite and positive"),
        ({"lam": 3.0, "w_f": -1.0}, "w_f must be finite and not negative"),
        ({"lam": 3.0, "w_f": 1.0, "n": 1.5}, "whole number from 1"),
        ({"lam": 3.0, "w_f": 1.0, "digits": 0}, "digits must be a whole number from 1"),
        ({"lam": [3.0, 4.0], "w_f": 1.0}, "one number"),
    ]:
        with pytest.raises(ValueError, match=match):
            certify(**arguments)


def test_command(capsys):
    assert main(["certify", "--lam", "37.8", "--wf", "1352", "--n", "2", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert {"gamma", "gamma_radius", "R_x0", "R_x0_radius", "x_f", "x_f_radius", "n_proved", "unique", "status"} <= set(
        found
    )
    assert found["gamma"].startswith("3.417567056914487908780")
    assert found["status"] == CERTIFIED
    assert main(["certify", "--lam", "1.2", "--wf", "0"]) == 4
    assert NO_TRANSITION in capsys.readouterr().err
    assert main(["certify", "--lam", "2", "--wf", "0", "--gamma", "1"]) == 0
    assert capsys.readouterr().out.startswith("outward   R_x0 3.81945796637")
    assert main(["certify", "--lam", "1.2"]) == 2
    assert "either an ATLAS, or a cable" in capsys.readouterr().err


def test_without_python_flint_the_remedy_is_said():
    code = "import sys; sys.modules['flint'] = None; from towatlas.cli import main; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", code, "certify", "--lam", "37.8", "--wf", "1352"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "pip install 'towatlas[certify]'" in done.stderr


@pytest.fixture(scope="module")
def small_atlas(tmp_path_factory):
    path = tmp_path_factory.mktemp("certify") / "atlas.nc"
    build_atlas(path, grid=SMALL_GRID, scan=ScanSettings(w_f=np.array([1.0]), lam=np.array([3.0])), progress=False)
    return path


def test_nodes_of_an_atlas_are_proved_from_run_to_run(small_atlas, capsys):
    out = small_atlas.with_name("certified.nc")
    certify_atlas(small_atlas, out, count=2, progress=False)
    first = read_certified(out)
    assert (first.outcome == 1).sum() == 2
    # The patience of the command is not that of a table.
    assert main(["certify", str(small_atlas), "--patience", "1e-6"]) == 0
    whole = read_certified(out)
    tried = whole.outcome > 0
    assert tried.sum() == 6  # of eight two are short of their thresholds
    assert (whole.outcome[tried] == 1).all()
    assert (whole.holds[tried] == 1).all()
    assert (whole.gamma_radius[first.outcome == 1] == first.gamma_radius[first.outcome == 1]).all()
    capsys.readouterr()
    assert main(["info", str(small_atlas)]) == 0
    assert "certified.nc: stored errors" in capsys.readouterr().out
    assert main(["info", str(out)]) == 0
    assert "hold at every node proved, 6" in capsys.readouterr().out


def test_proofs_of_another_atlas_are_not_touched(small_atlas, tmp_path):
    out = tmp_path / "certified.nc"
    certify_atlas(small_atlas, out, count=0, progress=False)
    other = tmp_path / "atlas.nc"
    grid = dataclasses.replace(SMALL_GRID, w_f=np.array([0.0, 2.0]))
    build_atlas(other, grid=grid, scan=ScanSettings(w_f=np.array([1.0]), lam=np.array([3.0])), progress=False)
    with pytest.raises(AtlasFileError, match="about another atlas"):
        certify_atlas(other, out, progress=False)
    with pytest.raises(AtlasFileError, match="holds no proofs"):
        read_certified(other)
