"""The command line: `towatlas`, or `python -m towatlas`.

Exit codes: 0 ok, 1 the computation failed, 2 usage, 3 outside the atlas, 4 no such state, 5 a file that cannot be read
or written, is damaged, or holds something else, 6 a limit that was set is not kept.
"""

import argparse
import math
import os
import sys
from collections.abc import Iterable
from contextlib import nullcontext
from importlib import import_module
from pathlib import Path
from typing import Any

from towatlas import __version__
from towatlas.commands.common import FAILED, FILE, OK, USAGE, announce_compilation, say, shown_progress
from towatlas.commands.examples import add_examples
from towatlas.effort import patience
from towatlas.kernels.notice import CompilerError
from towatlas.tables.seal import AtlasFileError

# In the order in which help lists them; each a module of towatlas.commands.
COMMANDS = (
    "critical",
    "certify",
    "folds",
    "equilibria",
    "stability",
    "flutter",
    "diagram",
    "shape",
    "fish",
    "scene",
    "sweep",
    "design",
    "device",
    "map",
    "build",
    "plot",
    "explore",
    "export",
    "report",
    "info",
    "warmup",
)


def _parser(names: Iterable[str] = COMMANDS) -> argparse.ArgumentParser:
    """The parser of these commands, whose modules are imported for it."""
    parser = argparse.ArgumentParser(
        prog="towatlas",
        description="Critical speeds of a cable towed in a circle: at what speed does it jump, and to what shape?",
        epilog="Exit codes: 0 ok, 1 computation failed, 2 usage, 3 outside the atlas, 4 no such state, 5 a file "
        "that cannot be read, is damaged or holds something else, 6 a limit that was set is not kept (towatlas scene: "
        "--margin, cable.breaking_strength).",
    )
    parser.add_argument("--version", action="version", version=f"towatlas {__version__}")
    parser.add_argument(
        "--print-completion",
        action=_PrintCompletion,
        choices=("bash", "zsh", "tcsh"),
        metavar="SHELL",
        help="print what makes bash, zsh or tcsh complete commands and options, and exit; needs the extra completion",
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    for name in names:
        import_module(f"towatlas.commands.{name}").add(commands)
        add_examples(commands.choices[name], name)
    return parser


class _PrintCompletion(argparse.Action):
    """Print what makes a shell complete commands, options and names of files."""

    def __call__(self, parser: argparse.ArgumentParser, namespace: Any, values: Any, option: str | None = None) -> None:
        try:
            import shtab
        except ImportError:
            parser.error(f"{option} needs shtab, which is not installed: pip install 'towatlas[completion]'")
        commands = next(action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
        for command in commands.choices.values():
            for action in command._actions:
                if action.type is Path or action.metavar in ("SCENE", "FILE", "SPEC", "DEVICE.toml"):
                    action.complete = shtab.FILE  # type: ignore[attr-defined]
        print(shtab.complete(parser, values))
        parser.exit()


def main(arguments: list[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    arguments = sys.argv[1:] if arguments is None else arguments
    if "numpy" not in sys.modules:
        # Matrices of a few rows are no work for two: threads of BLAS that wait for more take a tenth of the time.
        for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
            os.environ.setdefault(name, "1")
    # Who asks for one command does not wait for the modules of the others.
    named = arguments[:1] if arguments and arguments[0] in COMMANDS else COMMANDS
    options = _parser(named).parse_args(arguments)
    announce_compilation()
    # Commands without that option look up, or take their time and show it themselves.
    limited = "patience" in options
    try:
        with shown_progress() if limited else nullcontext(), patience(options.patience if limited else math.inf):
            return options.run(options)
    except AtlasFileError as error:
        say(str(error))
        return FILE
    except ValueError as error:
        say(str(error))
        return USAGE
    except (ArithmeticError, CompilerError) as error:
        say(str(error))
        return FAILED
    except MemoryError:
        say("there is not enough memory for that many points")
        return FAILED
    except BrokenPipeError:
        sys.stderr.close()
        return OK
    except OSError as error:
        say(str(error))
        return FILE
    except KeyboardInterrupt:
        say("interrupted")
        return 130
