"""The least model: what each question needs on the report's systems, and what breaks each comparison."""

import json
import tomllib
from dataclasses import replace
from math import nan
from pathlib import Path

import numpy as np
import pytest
import reference_drag
from helpers import changed, run

from benchmarks import models
from towatlas.commands.scene import text_of
from towatlas.kernels import status
from towatlas.report.nrl7048.page import PHOTOGRAPHS
from towatlas.scene.choice import choose, compare, least_model
from towatlas.scene.file import make_scene, read_scene
from towatlas.scene.jumps import answer_scene
from towatlas.scene.models import QUESTIONS, check_questions, solvable_models, solve_model

HANGS = ("nodes", "position", "tension")
PAGE = (Path(__file__).parent.parent / "docs" / "scenes.md").read_text()
PAGE_SCENE = PAGE.split("```toml\n")[1].split("```")[0]


@pytest.fixture(scope="module")
def photographs():
    """Scene, nodes photographed, and the answers of two models, without critical speeds."""
    rows = []
    for photograph in PHOTOGRAPHS:
        scene = read_scene(f"skop-fig{photograph.figure[0]}").at(gamma=photograph.gamma)
        rows.append((scene, photograph.nodes, [solve_model(scene, model) for model in ("vacuum", "air")]))
    return rows


@pytest.mark.parametrize(
    ("asked", "tolerance", "chosen"),
    [(("nodes",), 0.01, "vvvvaavv"), (HANGS, 0.01, "vavvaaav"), (HANGS, 0.1, "vvvvaavv")],
)
def test_models_of_the_photographs(photographs, asked, tolerance, chosen):
    """Asked for the nodes alone, the rule takes drag on exactly where the vacuum is wrong."""
    found = [choose(replace(scene, tolerance=tolerance), answers, asked) for scene, _, answers in photographs]
    assert "".join(choice.model[0] for choice in found) == chosen
    if asked == ("nodes",):
        assert [choice.model == "vacuum" for choice in found] == [
            answers[0].nodes == nodes for _, nodes, answers in photographs
        ]
        assert [choice.answer.nodes for choice in found] == [nodes for _, nodes, _ in photographs]


def test_a_fold_that_drag_takes_away():
    """Where the fish hangs is the vacuum's to seven digits; the next jump, at gamma = 3.34, does not exist."""
    scene = read_scene("skop-fig3").at(gamma=1.64)
    answer = answer_scene(scene)
    assert answer.choice.model == "air"
    gone = [d for d in answer.choice.differences if not d.agrees]
    assert {(d.smaller, d.quantity, d.status_larger) for d in gone} == {("vacuum", "jump above", status.NOT_FOUND)}
    assert "vacuum differs from air in jump above (1.4" in answer.choice.reason
    assert "air agrees with water within 1 %, at most 0.0" in answer.choice.reason
    assert answer.equilibria is answer.choice.answer.equilibria
    assert answer.equilibria.system.C == scene.system("air").C
    assert answer_scene(scene, asked=HANGS).choice.model == "vacuum"
    text = text_of(answer, compare=True)
    lines = text.splitlines()
    assert sum(line.startswith("vacuum  air ") and line.endswith("disagrees") for line in lines) == 1
    (row,) = (line for line in lines if line.endswith("vacuum, n = 1"))
    assert "1 to 3" in row
    assert text.count("  expected") == 1


def test_buoyancy_without_drag():
    """Towed slowly in water: drag adds nothing, and the next larger model alone would vouch for the vacuum."""
    choice = least_model(make_scene(changed(tow__speed=0.005)), asked=HANGS)
    assert choice.model == "water"
    by_pair = {(d.smaller, d.larger, d.question): d for d in choice.differences}
    assert all(by_pair["vacuum", "air", question].agrees for question in HANGS)
    assert by_pair["vacuum", "water", "tension"].relative > 0.3
    # W - W' and the cable's weight, hanging straight down.
    weight = (60 - 20.5 + 150 * (0.5 - 1025 * np.pi * 36e-6)) * 9.80665
    assert choice.answer.tension == pytest.approx(weight, rel=1e-4)
    assert "water is the largest model" in choice.reason


def test_differences():
    """Of two answers made up."""
    scene = make_scene(changed(fluid={"name": "vacuum"}))
    one = solve_model(scene, "vacuum", (0.1 * scene.gamma, 10.0 * scene.gamma))
    assert one.folds is not None

    def jumping(below, above, complete=True):
        speeds = np.array([below, above]) * scene.gamma
        return replace(one.folds, gamma=speeds[np.isfinite(speeds)], complete=complete)

    one = replace(one, folds=jumping(0.5, 2.0))
    moved = one.position + np.array([0.0, 0.0, 1.0])
    other = replace(
        one,
        model="air",
        folds=jumping(0.5025, nan),
        position=moved,
        tension=one.tension * 1.005,
        nodes=one.nodes + 1,
    )
    found = {d.quantity: d for d in compare(one, other, scene)}
    slant = np.linalg.norm(moved - [40.0, 0.0, 0.0])
    assert found["position of the fish"].relative == pytest.approx(1.0 / slant, rel=1e-12)
    assert found["tow tension"].relative == pytest.approx(1 - 1 / 1.005, rel=1e-9)
    assert found["jump below"].relative == pytest.approx(1 - 1 / 1.005, rel=1e-9)
    assert found["jump below"].by_larger == pytest.approx(scene.speed_of(0.5025 * scene.gamma), rel=1e-15)
    agreed = {quantity for quantity, d in found.items() if d.agrees}
    assert agreed == {"position of the fish", "tow tension", "number of equilibria", "jump below"}
    assert found["jump above"].words == f"{scene.speed_of(2.0 * scene.gamma):.4g}, none"
    unknown = {d.quantity: d for d in compare(one, replace(other, folds=jumping(0.5, 2.0, False)), scene)}
    assert unknown["jump above"].words.endswith(", not known")
    assert not unknown["jump below"].agrees
    none = {
        d.quantity: d for d in compare(*(replace(answer, folds=jumping(nan, nan)) for answer in (one, other)), scene)
    }
    assert none["jump below"].agrees
    assert none["jump above"].agrees
    strict = {d.quantity for d in compare(one, other, replace(scene, tolerance=1e-3)) if d.agrees}
    assert strict == {"number of equilibria"}
    assert compare(one, other, replace(scene, tolerance=0.5 / slant))[1].agrees is False
    # Without jumps of both nothing is said of them.
    assert len(compare(replace(one, folds=None), other, scene)) == 4
    assert choose(scene, [one, other], ("tension",)).model == "vacuum"
    assert choose(scene, [one, other], ("nodes", "tension")).model == "air"
    assert choose(scene, [one, other], ("speeds",)).model == "air"
    assert choose(scene, [one, replace(other, folds=jumping(0.5, 2.01))], ("speeds",)).model == "vacuum"


def test_one_model():
    vacuum = make_scene(changed(fluid={"name": "vacuum"}))
    choice = least_model(vacuum)
    assert (choice.model, choice.forced, choice.differences) == ("vacuum", False, ())
    assert "nothing to add" in choice.reason
    choice = least_model(make_scene(changed()), "vacuum")
    assert (choice.model, choice.forced, len(choice.answers)) == ("vacuum", True, 1)
    assert "compared with no other" in choice.reason
    # A fluid that neither drags nor buoys is the vacuum.
    thin = make_scene(changed(cable__drag_coefficient=0, fish__drag_coefficient=0, fluid__density=1e-3))
    choice = least_model(thin, "air")
    assert choice.answer.equilibria.R_x0 == pytest.approx(least_model(thin, "vacuum").answer.equilibria.R_x0)


def test_keys_that_are_missing():
    scene = make_scene(changed(fluid={"name": "air"}, fish__volume=None, tow__speed=0.5))
    assert solvable_models(scene) == (["vacuum", "air"], ["water"])
    assert (
        "water was not tried: it needs fish.volume or fish.submerged_weight" in least_model(scene, asked=HANGS).reason
    )
    with pytest.raises(ValueError, match="the water model needs w_f, for which keys of the scene are missing"):
        least_model(scene, "water")
    with pytest.raises(ValueError, match="model must be one of vacuum, air, water"):
        least_model(scene, "mud")
    assert check_questions(["tension", "nodes"]) == ("nodes", "tension")
    for bad in ([], ["nodes", "colour"]):
        with pytest.raises(ValueError, match="asked must be some of nodes, position, tension, speeds"):
            check_questions(bad)


def test_a_cable_that_floats_without_a_fish():
    """It hangs upwards: the fish end is above the tow point."""
    scene = make_scene(changed(fish=None, cable__mass_per_length=0.1))
    choice = least_model(scene)
    assert choice.model == "water"
    hanging, floating = choice.answers[1], choice.answers[2]
    assert floating.system.w < 0
    assert floating.position[2] < 0 < hanging.position[2]


def test_far_beyond_the_drag_of_the_report():
    """The scene of the page, C = 559: a long-double shot from its fish comes to the tow point, with its tension."""
    scene = make_scene(tomllib.loads(PAGE_SCENE))
    answer = solve_model(scene, "water")
    system = answer.system
    assert system.C > 500
    end = reference_drag.shot(np.hypot(*answer.position[:2]) / scene.radius, scene.gamma, system)
    x, y, z, *force = np.asarray(end, float)
    assert np.hypot(x, y) == pytest.approx(1.0, abs=1e-10)
    assert -z * scene.radius == pytest.approx(answer.position[2], rel=1e-10)
    assert np.linalg.norm(force) * scene.force_unit("water") == pytest.approx(answer.tension, rel=1e-10)
    # The fish at (r, 0) there, the tow point at (1, 0) here.
    turned = (x - 1j * y) * np.hypot(*answer.position[:2])
    assert answer.position[:2] == pytest.approx([turned.real, turned.imag], rel=1e-9)


def test_shell(capsys):
    arguments = ("scene", "skop-fig4", "--gamma", 4.77, "--asked", "nodes,tension")
    code, out, _ = run(capsys, *arguments, "--json")
    answer = json.loads(out)
    assert (code, answer["model"], answer["model_forced"], answer["asked"]) == (0, "air", False, ["nodes", "tension"])
    assert answer["model_reason"].startswith("vacuum differs from air in number of nodes (2, 3), tow tension (9.5 %)")
    nodes, tension = answer["comparisons"][:2]
    assert (nodes["by_smaller"], nodes["by_larger"], nodes["agrees"]) == (2, 3, False)
    assert tension["relative_difference"] == pytest.approx(0.0955, abs=1e-4)
    near = next(row for row in answer["equilibria"] if row["expected"])
    assert near["nodes"] == 3
    assert near["r_f_m"] == pytest.approx(np.hypot(near["x_f_m"], near["y_f_m"]), rel=1e-12)
    turned = np.degrees(np.arctan2(-near["y_f_m"], near["x_f_m"]))
    assert near["phase_deg"] % 360 == pytest.approx(turned % 360, rel=1e-9)
    assert round(near["phase_deg"] / 180) == near["nodes"]
    code, out, _ = run(capsys, *arguments, "--model", "vacuum")
    assert code == 0
    assert "vacuum model: vacuum was asked for, and compared with no other" in out
    assert "equilibria (vacuum model)" in out
    code, _, err = run(capsys, *arguments, "--asked", "colour")
    assert code == 2
    assert "asked must be some of" in err


def test_a_design_is_by_the_model_that_holds(capsys, tmp_path):
    (tmp_path / "wet.toml").write_text(PAGE_SCENE)
    arguments = ("design", "--scene", tmp_path / "wet.toml", "--depth", "120 m")
    code, out, _ = run(capsys, *arguments, "--json")
    assert code == 0
    answer = json.loads(out)
    (row,) = answer["cables"]
    assert (row["expected"], answer["model"]) == (True, "water")
    assert "vacuum differs from" in answer["model_reason"]
    exact = solve_model(replace(make_scene(tomllib.loads(PAGE_SCENE)), length=row["length_m"]), "water")
    assert [row["x_f_m"], row["y_f_m"], row["z_f_m"]] == pytest.approx(list(exact.position), rel=1e-9)
    assert (row["nodes"], row["z_f_m"]) == (exact.nodes, pytest.approx(120.0, rel=1e-10))
    assert "model: water; vacuum differs" in run(capsys, *arguments)[1]
    assert json.loads(run(capsys, *arguments, "--model", "vacuum", "--json")[1])["model"] == "vacuum"
    out = run(capsys, "design", "--scene", "skop-fig3", "--depth", "25 in", "--max-radius", "1 mm")[1]
    assert "model: vacuum; vacuum agrees with air and water" in out


def test_questions_are_named_in_help(capsys):
    out = run(capsys, "scene", "--help")[1]
    for question in QUESTIONS:
        assert question in out


def test_benchmark(tmp_path):
    found = models.measure([("skop-fig5", 2.6, 2)])
    table = models.systems_table(found)
    assert "| skop-fig5 | 2.6 | 2 | **1**, 2, 2 | 11 %, 26 % |" in table
    assert table.splitlines()[-1].endswith("| air | air | air | air | air |")
    assert models.models_table(found).splitlines()[2].startswith("| vacuum | 0 of 1 | 11 %, 26 % |")
    models.write_csv(found, tmp_path / "models.csv")
    lines = (tmp_path / "models.csv").read_text().splitlines()
    assert len(lines) == 4
    models.draw(found, [tmp_path / "models.svg"])
    assert (tmp_path / "models.svg").stat().st_size > 5000
    marks = "<!-- models: written by python -m benchmarks.models -->\nold<!-- end of models -->"
    assert models.put(marks, "models", "new\n") == marks.replace("old", "new\n")


def test_page_says_what_is_chosen():
    rows = [line.split(" | ") for line in PAGE.splitlines() if line.startswith("| skop-fig")]
    assert ["".join(row[k].strip(" |")[0] for row in rows) for k in (6, 7, 8)] == ["vvvvaavv", "vavvaaav", "vvvvaavv"]
    assert {row[k].strip(" |") for row in rows for k in (9, 10)} == {"air"}
