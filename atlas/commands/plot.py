"""`towatlas plot`: draw a figure."""

import argparse
from pathlib import Path
from typing import Any

from towatlas.commands.common import FIGURE_FORMATS, OK, add_atlas, add_patience, new_figure, save_figure
from towatlas.tables.atlas import open_atlas

FIGURES = {
    "critical": "critical speeds against cable length, from an atlas",
    "drag": "how drag closes the jumps, solved",
    "stability": "where the shape with one node appears and flutters in a vacuum, solved; takes a minute",
    "flutter": "where shapes of one, two and three nodes begin and cease to flutter, from an atlas with growth rates",
    "device": "the tightest turns of lateral force devices, solved",
}
ELSEWHERE = {
    "scene SCENE --out FILE": "its shapes from the side and from above, its jumps",
    "shape SCENE --out FILE": "one of these shapes, in m and N",
    "shape --lam ... --out FILE": "the shape of a cable without units",
    "diagram --lam ... --out FILE": "every branch of shapes over the speed, what of it lasts",
    "sweep SCENE ... --out FILE": "depth, radius, tension, phase over length or speed",
    "report": "a source document with its figures, as a page",
}


def _listed(title: str, figures: dict[str, str]) -> str:
    return "\n".join([title, *(f"  {name:<28} {words}" for name, words in figures.items())])


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "plot",
        help="draw a figure",
        description="Draw a figure.",
        epilog=_listed("figures:", FIGURES) + "\n\n" + _listed("by other commands, towatlas ...", ELSEWHERE),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("figure", choices=tuple(FIGURES), help="one of those below")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="FILE.svg, .png or .pdf")
    add_atlas(parser)
    add_patience(parser)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    if options.out.suffix.lower() not in FIGURE_FORMATS:
        raise ValueError(f"--out {options.out}: the ending must be one of {', '.join(FIGURE_FORMATS)}")
    if options.figure == "drag":
        figure, axes = new_figure(7.2, 4.8)
        from towatlas.plot.drag_folds import plot_drag_folds

        plot_drag_folds(ax=axes)
        save_figure(figure, options.out)
        return OK
    if options.figure == "stability":
        figure, axes = new_figure(7.2, 7.0)
        figure.clear()
        from towatlas.plot.boundaries import plot_boundaries

        plot_boundaries(axes=list(figure.subplots(2, 2).ravel()))
        save_figure(figure, options.out)
        return OK
    if options.figure == "device":
        figure, axes = new_figure(7.2, 4.8)
        from towatlas.plot.device import plot_turns

        plot_turns(axes)
        save_figure(figure, options.out)
        return OK
    atlas = open_atlas(options.atlas)
    if options.figure == "flutter":
        figure, axes = new_figure(7.2, 6.4)
        figure.clear()
        from towatlas.plot.boundaries import plot_held

        plot_held(atlas, figure.subplots(atlas.stability.n_max, 4, sharex=True, sharey=True, squeeze=False))
        save_figure(figure, options.out)
        return OK
    figure, axes = new_figure(7.2, 4.8)
    from towatlas.plot.critical import plot_critical

    plot_critical(atlas, ax=axes)
    save_figure(figure, options.out)
    return OK
