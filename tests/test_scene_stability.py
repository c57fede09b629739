"""Which shapes of a scene last: growth in seconds, by every model, within the patience."""

import json

import numpy as np
import pytest
from helpers import WET, run

import towatlas
from towatlas.commands.scene_stability import lines_of
from towatlas.effort import TooMuchWork, at_most, check_patience, patience
from towatlas.scene import verdicts
from towatlas.scene.file import make_scene, read_scene
from towatlas.scene.jumps import answer_scene
from towatlas.scene.verdicts import verdicts_of

FIG3 = ("scene", "skop-fig3", "--gamma", 5.94, "--asked=nodes,position")


def test_growth_in_seconds_is_that_of_the_system(capsys):
    code, out, _ = run(capsys, *FIG3, "--model=air", "--json")
    assert code == 0
    answer = json.loads(out)
    scene, groups = read_scene("skop-fig3"), answer["groups"]
    rate = np.sqrt(scene.gravity / scene.radius)
    fluid = {name: groups[name] for name in ("C", "m_f", "C_f", "w")}
    found = towatlas.stability(groups["lam"], groups["w_f"], groups["gamma"], **fluid)
    assert [row["branch"] for row in answer["stability"]] == list(found.equilibria.branch)
    for k, row in enumerate(answer["stability"]):
        assert row["kind"] == found.kind[k]
        assert row["unstable"] == found.unstable[k]
        assert row["growth_1_s"] == pytest.approx(found.growth[k] * rate, rel=1e-6, abs=1e-9)
        assert row["frequency_Hz"] == pytest.approx(found.frequency[k] * rate / (2 * np.pi), rel=1e-6)


def test_words(capsys):
    """The published window: the two-node shape of the photograph at 5.94 flutters."""
    out = run(capsys, *FIG3, "--model=air")[1]
    assert "which shapes last (air model):" in out
    assert "shape 1, expected: flutters, e times larger in 0.28" in out
    assert "shape 2: left without turning back" in out
    assert "nothing damps in the vacuum model" in run(capsys, *FIG3, "--model=vacuum")[1]


def test_a_larger_model_that_differs_is_heard():
    """Asked for nodes the vacuum answers, in which nothing grows; the drag of the air drives a slow pendulum mode."""
    answer = answer_scene(read_scene("skop-fig4").at(gamma=2.46), asked=("nodes",))
    found = verdicts_of(answer)
    assert (answer.choice.model, found.shapes[answer.equilibria.expected].kind) == ("vacuum", "stable")
    assert {model: verdict.kind for model, verdict in found.by_larger.items()} == {"air": "weak", "water": "weak"}
    assert "  but by the air model the shape expected: grows weakly" in "\n".join(lines_of(found, answer))


def test_what_is_not_reached_is_not_called_stable(capsys, monkeypatch):
    monkeypatch.setattr(verdicts, "SHARE", 1e-9)
    code, out, _ = run(capsys, *FIG3, "--json")
    assert code == 0
    rows = json.loads(out)["stability"]
    assert {row["kind"] for row in rows} == {"unknown"}
    assert all("--patience" in row["reason"] and row["growth_1_s"] is None for row in rows)
    assert "expected: not known (growth rates: not finished in" in run(capsys, *FIG3)[1]


def test_flow_that_outruns_waves_is_said():
    table = {name: dict(keys) for name, keys in WET.items() if name != "fish"}
    found = verdicts_of(answer_scene(make_scene(table), model="water", asked=("nodes",)))
    assert [shape.kind for shape in found.shapes] == ["unknown"]
    assert "bare end" in found.shapes[0].reason


def test_a_share_of_the_patience(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("time.process_time", lambda: now[0])
    with patience(10.0):
        now[0] = 7.0
        with at_most(0.2):
            now[0] += 1.9
            check_patience("sharing", "")
            now[0] += 0.2
            with pytest.raises(TooMuchWork, match="not finished in 2 s"):
                check_patience("sharing", "")
        check_patience("the rest", "")
        # No more than is left.
        with at_most(0.2):
            now[0] += 1.0
            with pytest.raises(TooMuchWork, match=r"not finished in 0.9 s"):
                check_patience("sharing", "")
