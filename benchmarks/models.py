"""`python -m benchmarks.models`: what each model of the report's Table 1 costs and buys, on its eight photographs.

Writes docs/models.svg and .png, docs/data/models.csv and the tables of docs/scenes.md.
"""

import csv
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from towatlas.report.nrl7048 import page as report
from towatlas.scene.choice import Choice, choose, compare
from towatlas.scene.file import read_scene
from towatlas.scene.jumps import SceneAnswer, answer_scene
from towatlas.scene.models import QUESTIONS
from towatlas.scene.scene import MODELS

DOCS = Path(__file__).parent.parent / "docs"
# Scene, gamma and nodes of each photograph (NRL Report 7048, Figs. 3 to 5).
PHOTOGRAPHS = tuple((f"skop-fig{p.figure[0]}", p.gamma, p.nodes) for p in report.PHOTOGRAPHS)
HANGS = ("nodes", "position", "tension")
TOLERANCES = (0.01, 0.1)
COLUMNS = (
    "scene",
    "gamma",
    "photographed_nodes",
    "model",
    "nodes",
    "equilibria",
    "position_difference_to_next",
    "tension_difference_to_next",
    "seconds_shape",
    "seconds_with_critical_speeds",
)


@dataclass(frozen=True)
class Photograph:
    """One photograph: the choice with all models' answers, and for each model the seconds of one answer.

    shape : seconds of the equilibria alone. whole : with critical speeds, none of them looked up.
    """

    scene: str
    gamma: float
    nodes: int
    choice: Choice
    shape: dict[str, float]
    whole: dict[str, float]

    def differences(self, place: int) -> tuple[float, float]:
        """Relative differences of a model, counted from 0, from the next: position, tension; nan for the last."""
        if place + 1 == len(MODELS):
            return float("nan"), float("nan")
        scene = read_scene(self.scene).at(gamma=self.gamma)
        found = compare(self.choice.answers[place], self.choice.answers[place + 1], scene)
        by_question = {difference.question: difference.relative for difference in found[:3]}
        return by_question["position"], by_question["tension"]

    def chosen(self, asked: Sequence[str], tolerance: float) -> str:
        """The model chosen for some questions."""
        scene = replace(read_scene(self.scene).at(gamma=self.gamma), tolerance=tolerance)
        return choose(scene, self.choice.answers, asked).model


def _timed(function: Callable[..., SceneAnswer], **options: Any) -> tuple[float, SceneAnswer]:
    """The shortest of some calls, as many as half a second holds, five at most; and what they return."""
    times: list[float] = []
    while len(times) < 5 and sum(times) < 0.5:
        start = time.perf_counter()
        answer = function(**options)
        times.append(time.perf_counter() - start)
    return min(times), answer


def measure(photographs: Sequence[tuple[str, float, int]] = PHOTOGRAPHS) -> list[Photograph]:
    """Answers and times of all models, in one run."""
    answer_scene(read_scene("skop-fig3"), asked=HANGS)  # compiles what is not
    found = []
    for name, gamma, nodes in photographs:
        scene = read_scene(name).at(gamma=gamma)
        shape = {model: _timed(answer_scene, scene=scene, model=model, asked=HANGS) for model in MODELS}
        whole = {model: _timed(answer_scene, scene=scene, model=model) for model in MODELS}
        answers = [whole[model][1].choice.answer for model in MODELS]
        choice = choose(scene, answers, QUESTIONS)
        seconds = [{model: spent for model, (spent, _) in times.items()} for times in (shape, whole)]
        found.append(Photograph(name, gamma, nodes, choice, *seconds))
    return found


def write_csv(found: list[Photograph], path: Path) -> None:
    """A row for each photograph and model."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for row in found:
            for place, answer in enumerate(row.choice.answers):
                apart = [f"{value:.3g}" for value in row.differences(place)]
                spent = [f"{seconds[answer.model]:.3g}" for seconds in (row.shape, row.whole)]
                numbers = (row.nodes, answer.model, answer.nodes, answer.number)
                writer.writerow([row.scene, row.gamma, *numbers, *apart, *spent])


def systems_table(found: list[Photograph]) -> str:
    """Markdown: each photograph, what the models say of it, and which is chosen for what."""
    lines = [
        "| scene | gamma | nodes in the photograph | by vacuum, air, water | vacuum to air: position, tension "
        "| air to water | for nodes | shape, 1 % | shape, 10 % | all, 1 % | all, 10 % |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in found:
        nodes = ", ".join(
            f"{answer.nodes}" if answer.nodes == row.nodes else f"**{answer.nodes}**" for answer in row.choice.answers
        )
        apart = [", ".join(f"{100 * value:.2g} %" for value in row.differences(place)) for place in (0, 1)]
        chosen = [row.chosen(("nodes",), TOLERANCES[0])]
        chosen += [row.chosen(asked, tolerance) for asked in (HANGS, QUESTIONS) for tolerance in TOLERANCES]
        cells = [row.scene, f"{row.gamma:g}", str(row.nodes), nodes, *apart, *chosen]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def models_table(found: list[Photograph]) -> str:
    """Markdown: what each step up costs and buys."""
    lines = [
        "| model | nodes as photographed | largest difference from the next: position, tension "
        "| shape: time, ratio | with critical speeds: time, ratio |",
        "|---|---|---|---|---|",
    ]
    for place, model in enumerate(MODELS):
        right = sum(row.choice.answers[place].nodes == row.nodes for row in found)
        apart = np.array([row.differences(place) for row in found]).max(axis=0)
        words = "-" if np.isnan(apart).any() else ", ".join(f"{100 * value:.2g} %" for value in apart)
        cells = [model, f"{right} of {len(found)}", words]
        for times in ([row.shape for row in found], [row.whole for row in found]):
            median = float(np.median([row[model] for row in times]))
            ratio = float(np.median([row[model] / row["vacuum"] for row in times]))
            cells.append(f"{median:.2g} s, {ratio:.0f}" if median >= 0.1 else f"{1e3 * median:.2g} ms, {ratio:.0f}")
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def draw(found: list[Photograph], paths: Sequence[Path]) -> None:
    """Time of one shape beside its difference from the next larger model, which the largest one does not have."""
    import matplotlib.pyplot as plt

    colours = dict(zip(MODELS, ("#000000", "#D55E00", "#0072B2"), strict=True))
    with plt.rc_context({"svg.hashsalt": "towatlas"}):
        figure, ax = plt.subplots(figsize=(6.6, 4.4), layout="constrained")
        for place, model in enumerate(MODELS):
            right = np.array([row.choice.answers[place].nodes == row.nodes for row in found])
            spent = np.array([row.shape[model] for row in found])
            label = f"{model}: nodes as photographed {right.sum()} of {len(found)}"
            if place + 1 == len(MODELS):
                # Nothing to compare it with: its times stand on the axis.
                drawn: dict[str, Any] = {"transform": ax.get_xaxis_transform(), "clip_on": False}
                ax.plot(
                    spent, np.full(len(found), 0.0), "|", ms=16, mew=1.6, color=colours[model], label=label, **drawn
                )
                continue
            apart = 100.0 * np.array([max(row.differences(place)) for row in found])
            ax.plot(spent[right], apart[right], "o", color=colours[model], label=label)
            ax.plot(spent[~right], apart[~right], "X", ms=9, color=colours[model])
            for row, x, y in zip(found, spent, apart, strict=True):
                if row.choice.answers[place].nodes != row.nodes:
                    ax.annotate(
                        f"nodes: {row.choice.answers[place].nodes}, photographed {row.nodes}",
                        (x, y),
                        (8, 0),
                        textcoords="offset points",
                        va="center",
                    )
        ax.set(xscale="log", yscale="log", xlim=(1e-3, 10.0), ylim=(1e-6, 100.0))
        ax.axhline(1.0, color="0.6", linewidth=0.9, linestyle="--")
        ax.annotate("tolerance 1 %", (9.0, 1.0), (0, 3), textcoords="offset points", ha="right", color="0.4")
        ax.set_xlabel("time of one answer, shapes only [s]")
        ax.set_ylabel("difference from the next larger model [%]\nthe larger of position and tension")
        ax.grid(which="major", color="0.92", linewidth=0.6)
        ax.legend(frameon=False, loc="lower left")
        for path in paths:
            path.parent.mkdir(parents=True, exist_ok=True)
            figure.savefig(path, dpi=150, metadata={"Date": None} if path.suffix == ".svg" else None)
        plt.close(figure)


def put(page: str, name: str, text: str) -> str:
    """A page with the text between its two marks replaced."""
    begin, end = f"<!-- {name}: written by python -m benchmarks.models -->\n", f"<!-- end of {name} -->"
    before, rest = page.split(begin)
    return before + begin + text + end + rest.split(end)[1]


def main() -> None:
    """Measure; write the figure, the CSV and the tables."""
    found = measure()
    write_csv(found, DOCS / "data" / "models.csv")
    draw(found, [DOCS / "models.svg", DOCS / "models.png"])
    page = DOCS / "scenes.md"
    page.write_text(
        put(put(page.read_text(), "models", models_table(found)), "photographs", systems_table(found)), "utf-8"
    )
    print(models_table(found) + "\n" + systems_table(found))


if __name__ == "__main__":
    main()
