"""Examples that end the help of each command, a line each."""

import argparse

EXAMPLES: dict[str, tuple[str, ...]] = {
    "critical": (
        "towatlas critical --lam 37.8 --wf 1352             # every jump of this cable",
        "towatlas critical --lam 37.8 --wf 1352 --n 2 --json",
        "towatlas critical --lam 100 --wf 1 --n 40 --solve  # beyond the atlas",
        "towatlas critical --lam 13 --wf 0.5 --C 0.01 --solve",
    ),
    "certify": (
        "towatlas certify --lam 37.8 --wf 1352 --n 2 --digits 80",
        "towatlas certify --lam 37.8 --wf 1352 --gamma 5.94  # all equilibria at one speed",
        "towatlas certify atlas.nc --rows 1/8                # certified.nc beside it; once more goes on",
    ),
    "folds": (
        "towatlas folds --lam 16 --wf 3 --gamma 1:6          # in a vacuum",
        "towatlas folds --lam 16 --wf 3 --C 5.6 --gamma 1:6  # in air",
        "towatlas folds --lam 2.1 --wf 16 --w 0.5 --C 12 --gamma 0.1:5 --atlas short  # from a map of `towatlas map`",
    ),
    "equilibria": (
        "towatlas equilibria --lam 37.8 --wf 1352 --gamma 5.94",
        "towatlas equilibria --lam 37.8 --wf 1352 --gamma 5.94 --C 0.018 --json",
    ),
    "stability": ("towatlas stability --lam 37.8 --wf 1352 --gamma 5.94 --C 0.018",),
    "flutter": ("towatlas flutter --lam 37.8 --wf 1352 --C 0.018 --gamma 3.2:5",),
    "diagram": (
        "towatlas diagram --lam 10 --wf 1 --gamma 0.2:2 --out diagram.svg",
        "towatlas diagram skop-fig3 --speed 1.3:1.5 --out diagram.svg",
        "towatlas diagram skop-fig3 --length 10in:30in --out length.svg --patience 100",
    ),
    "shape": (
        "towatlas shape --lam 37.8 --wf 1352 --gamma 5.94 --out shape.svg",
        "towatlas shape --lam 10 --wf 1 --gamma 0.6 --root outward --points 101 --out shape.csv",
        'towatlas shape skop-fig3 --speed 2m/s --root "shape 2" --points 101',
    ),
    "fish": ("towatlas fish --lam 8 --wf 1 --gamma 0.9",),
    "scene": (
        "towatlas scene skop-fig3",
        "towatlas scene skop-fig3 --gamma 5.94 --json",
        "towatlas scene skop-fig3 --margin 10%  # exit code 6 if a jump is nearer than that",
        "towatlas scene search.toml --out search.html",
    ),
    "sweep": (
        "towatlas sweep skop-fig3 --speed 0.5:2.5 --out sweep.svg",
        "towatlas sweep search.toml --length 50m:2km --speed 3kn,5kn --out lengths.png",
        "towatlas sweep search.toml --speed 1kn:6kn --set fish.mass=50kg,100kg --out masses.nc",
    ),
    "design": (
        "towatlas design --scene skop-fig3 --depth 25in",
        "towatlas design --scene search.toml --depth 120m --speed 3kn:5kn --points 3",
    ),
    "device": (
        "towatlas device points --k 1 --alpha=-80deg --R 1.5",
        "towatlas device cycle --k 50 --alpha=-1.4rad --R 1.02",
        "towatlas device turn device.toml",
    ),
    "map": (
        "towatlas map wet-survey --dry-run       # what it would take",
        "towatlas map wet-survey --out wet       # on all cores of this machine",
        'towatlas map wet --at "C=6,lam=5.2,gamma=0.9"',
        "towatlas map wet --plot wet.svg",
    ),
    "build": (
        "towatlas build                          # the atlas, in seconds",
        "towatlas build --equilibria             # positions of the fish; then: towatlas fish",
        "towatlas build --drag --out drag.nc     # then: towatlas critical --atlas drag.nc --C 0.018 ...",
    ),
    "plot": (
        "towatlas plot critical --out critical.svg",
        "towatlas plot stability --out boundaries.svg --patience 200",
    ),
    "explore": (
        "towatlas explore --out explore.html",
        "towatlas explore --out explore.html search.toml",
    ),
    "export": (
        "towatlas export search.toml --moordyn run40       # then: python run40/drive.py 2",
        'towatlas export skop-fig3 --moordyn inner --gamma 5.94 --model vacuum --branch "1 inner"',
    ),
    "report": (
        "towatlas report",
        "towatlas report dtmb713 --out dtmb713.html",
    ),
    "info": (
        "towatlas info",
        "towatlas info equilibria.nc",
    ),
    "warmup": ("towatlas warmup",),
}


class HelpFormatter(argparse.HelpFormatter):
    """Texts are filled, but an epilog, whose lines are examples."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return text if text.startswith("examples:") else super()._fill_text(text, width, indent)


def add_examples(parser: argparse.ArgumentParser, command: str) -> None:
    """End the help of a command with its examples."""
    block = "\n".join(["examples:", *(f"  {line}" for line in EXAMPLES[command])])
    if parser.epilog is None:
        parser.formatter_class = HelpFormatter
        parser.epilog = block
    else:
        parser.epilog += f"\n\n{block}"
