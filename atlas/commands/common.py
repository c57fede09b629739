"""What the commands share: exit codes, messages, and the types of their arguments."""

import argparse
import math
import os
import sys
from pathlib import Path
from typing import Any

from towatlas.kernels import notice
from towatlas.tables.critical import default_path

OK, FAILED, USAGE, OUTSIDE, NO_STATE, FILE = 0, 1, 2, 3, 4, 5


def number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text!r} is not finite")
    return value


def length(text: str) -> float:
    value = number(text)
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f"lambda = {text} is not positive")
    return value


def speed(text: str) -> float:
    value = number(text)
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f"gamma = {text} is not positive")
    return value


def weight(text: str) -> float:
    value = number(text)
    if value < 0.0:
        raise argparse.ArgumentTypeError(f"w_f = {text} is negative")
    return value


def drag(text: str) -> float:
    value = number(text)
    if value < 0.0:
        raise argparse.ArgumentTypeError(f"{text} is negative: drag constants are not")
    return value


def order(text: str) -> int:
    try:
        value = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
    if not 1 <= value < 2**31:
        raise argparse.ArgumentTypeError(f"n = {text}: transitions are counted from 1")
    return value


def threads(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of threads")
    return int(text)


def add_atlas(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--atlas",
        type=Path,
        default=default_path(),
        metavar="FILE",
        help="default %(default)s; $TOWATLAS_FILE sets another",
    )


FIGURE_FORMATS = (".svg", ".png", ".pdf")


def new_figure(width: float, height: float, layout: str = "constrained") -> Any:
    """A figure and its axes, drawn without a screen, the same bytes every time."""
    os.environ["MPLBACKEND"] = "Agg"
    import matplotlib.pyplot as plt

    plt.rcParams["svg.hashsalt"] = "towatlas"
    return plt.subplots(figsize=(width, height), layout=layout)


def save_figure(figure: Any, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=200, metadata={"Date": None} if path.suffix.lower() == ".svg" else {})
    say(f"wrote {path}")


def say(message: str) -> None:
    print(f"towatlas: {message}", file=sys.stderr)


def announce_compilation() -> None:
    """Have the first kernel that is compiled say so: who waits is told why."""
    said: list[str] = []

    def announce(kernel: str) -> None:
        if not said:
            say("compiling, once after installation: this takes some seconds, for some commands half a minute")
        said.append(kernel)

    notice.listen(announce)
