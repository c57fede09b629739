"""What the commands share: exit codes, messages, and the types of their arguments."""

import argparse
import json
import math
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from towatlas import effort
from towatlas.kernels import notice
from towatlas.nomenclature import EQUILIBRIUM

OK, FAILED, USAGE, OUTSIDE, NO_STATE, FILE, LIMIT = 0, 1, 2, 3, 4, 5, 6
# Of what --json prints; raised when a key changes its name or its meaning, or goes.
JSON_SCHEMA = 5


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


def turn(text: str) -> float:
    value = number(text)
    if value == 0.0:
        raise argparse.ArgumentTypeError("gamma = 0: positive in a turn to starboard, negative in one to port")
    return value


def sine(text: str) -> float:
    value = float("inf") if text == "inf" else number(text)
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f"{text} is not positive")
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


def seconds(text: str) -> float:
    """Patience: infinite, too."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not value > 0.0:
        raise argparse.ArgumentTypeError(f"{text} s are no time")
    return value


def threads(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of threads")
    return int(text)


# The fluid: options, the names of their numbers in Python and what they are.
FLUID = (
    ("C", drag, "drag constant of the cable, (1/2) rho C_D d R / (mu + rho A)"),
    ("m-f", weight, "mass of the fish over (mu + rho A) R; default that of its weight"),
    ("C-f", drag, "drag constant of the fish, (1/2) rho C_Df A_f / (mu + rho A)"),
    ("w", number, "weight of the cable, (mu - rho A) / (mu + rho A); default 1"),
    ("C-t", drag, "tangential drag constant of the cable"),
    ("C-s", number, "side force constant of a stranded cable, rho d R a / (2 (mu + rho A)), positive to starboard"),
    ("b-s", sine, "sine at which the side force is largest; default inf"),
)


def add_cable(
    parser: argparse.ArgumentParser, gamma: bool = True, any_medium: bool = False, required: bool = True
) -> None:
    """The cable, its fish and its speed; in any medium a fish may float and a turn go to port."""
    fish, rate = (number, turn) if any_medium else (weight, speed)
    parser.add_argument("--lam", type=length, required=required, metavar="LAMBDA", help=EQUILIBRIUM["lam"].long_name)
    parser.add_argument("--wf", type=fish, required=required, metavar="W_F", help=EQUILIBRIUM["w_f"].long_name)
    if gamma:
        parser.add_argument("--gamma", type=rate, required=True, metavar="GAMMA", help=EQUILIBRIUM["gamma"].long_name)


def add_fluid(parser: argparse.ArgumentParser) -> None:
    """The fluid; a vacuum where none of these is given."""
    for option, kind, text in FLUID:
        parser.add_argument(f"--{option}", type=kind, metavar=option.replace("-", "_").upper(), help=text)


def fluid(options: argparse.Namespace) -> dict[str, float]:
    """What is given of the fluid, by its names in Python."""
    names = (option.replace("-", "_") for option, _, _ in FLUID)
    return {name: getattr(options, name) for name in names if getattr(options, name) is not None}


def print_json(answer: dict[str, Any] | list[dict[str, Any]]) -> None:
    """An object, or a list of them, each with the version of the schema."""
    version = {"schema_version": JSON_SCHEMA}
    print(json.dumps([version | row for row in answer] if isinstance(answer, list) else version | answer, indent=1))


def real(value: Any) -> float | None:
    """A number for JSON, which knows no nan."""
    return float(value) if math.isfinite(value) else None


def add_patience(parser: argparse.ArgumentParser) -> None:
    """How long it may take; `towatlas.cli` runs the command with it."""
    parser.add_argument(
        "--patience",
        type=seconds,
        default=effort.SECONDS,
        metavar="SECONDS",
        help="give up after so much CPU time, default %(default)g; inf for never",
    )


def add_atlas(parser: argparse.ArgumentParser, more: str = "") -> None:
    parser.add_argument(
        "--atlas",
        type=Path,
        metavar="FILE",
        help="default: $TOWATLAS_FILE, else what `towatlas build` made, else the one that came with the package" + more,
    )


FIGURE_FORMATS = (".svg", ".png", ".pdf")


def new_figure(width: float, height: float, layout: str = "constrained", rows: int = 1) -> Any:
    """A figure and its axes, one above the other, drawn without a screen, the same bytes every time."""
    os.environ["MPLBACKEND"] = "Agg"
    import matplotlib.pyplot as plt

    plt.rcParams["svg.hashsalt"] = "towatlas"
    return plt.subplots(rows, figsize=(width, height), layout=layout)


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


# A bar appears for who has waited so long, and is drawn anew so often, s.
BAR_DELAY, BAR_EVERY = 2.0, 0.2


@contextmanager
def shown_progress() -> Iterator[None]:
    """Long loops drawn as a bar on a terminal: what is done, and how much of the patience is used."""
    if not sys.stderr.isatty():
        yield
        return
    bars: list[Any] = []
    drawn = time.monotonic() + BAR_DELAY

    def draw(progress: effort.Progress | None) -> None:
        nonlocal drawn
        if progress is None:
            # An answer follows, on a line of its own.
            while bars:
                bars.pop().close()
        # Loops within, which do not know how far they have come, leave standing what the outer one said.
        elif time.monotonic() > drawn + BAR_EVERY and (progress.known or not bars):
            drawn = time.monotonic()
            if not bars:
                bars.append(_bar(progress.seconds))
            bars[0].n = progress.used
            bars[0].set_description(progress.words)

    effort.listen(draw)
    try:
        yield
    finally:
        draw(None)
        effort.listen(repr)


def _bar(total: float) -> Any:
    from tqdm import tqdm

    if math.isinf(total):
        return tqdm(leave=False, bar_format="{desc}{n:.0f} s of CPU")
    return tqdm(total=total, leave=False, bar_format="{desc}{n:.0f} of {total:.0f} s of CPU |{bar}|")
