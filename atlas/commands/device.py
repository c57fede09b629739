"""`towatlas device`: a lateral force device behind a ship in a circle."""

import argparse
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from towatlas.commands.common import NO_STATE, OK, add_patience, number, print_json, real, say
from towatlas.scene.units import parse_quantity

if TYPE_CHECKING:
    from towatlas.scene.device import Tow

EPILOG = """points        where it stands still behind the ship, and whether the line is taut
bifurcations  where that changes: along R at --alpha, along alpha at --R, or of a whole k
turn          the tightest turn in which it circles steadily
cycle         how it swings, where it does
tangle        the turns in which two lines lie on one bearing: DEVICE.toml with [[line]] twice

Without a file lengths are over that of the line, times over 1/omega, tensions over m L omega^2. With one, metres,
seconds and newtons. DEVICE.toml has [line] with length, mass, k and alpha, or lift_area, drag_area and density in place
of both, and [tow] with radius and speed."""


@dataclass(frozen=True)
class Asked:
    """What is asked about.

    Attributes
    ----------
    k, alpha, R : float or None
        As in `towatlas.device`.
    length, mass, speed : float
        Of the line [m], the device [kg] and the ship [m/s], by which answers are scaled; 1 where there is no file.
    real : bool
        Whether answers are in SI.
    """

    k: float
    alpha: float | None
    R: float | None
    length: float = 1.0
    mass: float = 1.0
    speed: float = 1.0
    real: bool = False

    def force(self, R: float) -> float:
        """m L omega^2 at a turning radius [N], 1 without units."""
        return self.mass * self.length * (self.speed / (R * self.length)) ** 2 if self.real else 1.0

    def time(self, R: float) -> float:
        """1/omega [s], 1 without units."""
        return R * self.length / self.speed if self.real else 1.0


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "device",
        help="a lateral force device: points, bifurcations, turns, cycles, tangling",
        description="A device that holds a line aside behind a ship in a circle: does it circle steadily, swing, or "
        "lose its line, and do two lines tangle?",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("what", choices=(*ANSWERS, "tangle"), help="what is asked, see below")
    parser.add_argument("device", nargs="?", metavar="DEVICE.toml", help="a device in real units, in place of --k")
    parser.add_argument("--k", type=number, help="force constant of the fluid k L/m")
    parser.add_argument(
        "--alpha", metavar="ANGLE", help="of the fluid's force against the velocity, as 60deg, --alpha=-80deg, 1.2rad"
    )
    parser.add_argument("--R", type=number, help="turning radius over the length of the line")
    parser.add_argument("--json", action="store_true", help="objects instead of a table")
    add_patience(parser)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    alpha = None if options.alpha is None else parse_quantity("--alpha", options.alpha, "rad")
    if options.what == "tangle":
        return _tangle(options)
    return ANSWERS[options.what](_asked(options, alpha), options.json)


def _asked(options: argparse.Namespace, alpha: float | None) -> Asked:
    if options.device is None:
        if options.k is None:
            raise ValueError("which device? Give --k (with --alpha and --R), or a file DEVICE.toml")
        return Asked(options.k, alpha, options.R)
    tow = _tow(options.device)
    if len(tow.lines) != 1:
        raise ValueError(f"{options.device}: {options.what} is of one [line]; two lines are for tangle")
    line = tow.lines[0]
    k = line.device.k if options.k is None else options.k
    R = None if math.isnan(tow.radius) else tow.radius / line.length
    return Asked(
        k,
        line.alpha if alpha is None else alpha,
        R if options.R is None else options.R,
        line.length,
        line.mass,
        tow.speed,
        True,
    )


def _tow(path: str) -> "Tow":
    from towatlas.scene.device import read_device

    tow = read_device(path)
    if not tow.speed_given:
        say("tow.speed is not given: tensions and times are those at 1 m/s, and go with its square and its inverse")
    return tow


def _needed(asked: Asked, what: str) -> tuple[float, float, float]:
    if asked.alpha is None:
        raise ValueError(f"{what} needs --alpha, as --alpha=-80deg")
    if asked.R is None:
        raise ValueError(f"{what} needs a turning radius: {'tow.radius, or ' if asked.real else ''}--R in line lengths")
    return asked.k, asked.alpha, asked.R


def _points(asked: Asked, json: bool) -> int:
    from towatlas.solve.device.points import points

    k, alpha, R = _needed(asked, "points")
    found = points(k, alpha, R)
    rows: list[dict[str, Any]] = [
        {
            "phi": p.phi,
            "stable": p.stable,
            "tension": float(p.tension * asked.force(R)),
            "physical": p.physical,
            "eigenvalues": [[e.real / asked.time(R), e.imag / asked.time(R)] for e in p.eigenvalues],
        }
        for p in found
    ]
    if json:
        print_json(rows)
    else:
        names = _unit("tension", "N", asked), _unit("growth", "1/s", asked)
        print(f"{'phi [deg]':>20} {'stable':>7} {names[0]:>20} {'taut':>5}  {names[1]}")
        for row in rows:
            rates = ", ".join(f"{a:.6g}{b:+.6g}i" if b else f"{a:.6g}" for a, b in row["eigenvalues"])
            print(
                f"{math.degrees(row['phi']):>20.13g} {_yes(row['stable']):>7} {row['tension']:>20.13g} "
                f"{_yes(row['physical']):>5}  {rates}"
            )
    if any(p.stable and p.physical for p in found):
        return OK
    if not found:
        say("no fixed point: in so tight a turn the device loses its line; `towatlas device turn` has the tightest")
        return NO_STATE
    if any(p.physical for p in found):
        say("no stable point on a taut line: `towatlas device cycle` tells whether the device swings")
    else:
        say("the line is slack at every fixed point: a line cannot push, and the device loses it")
    return OK


def _bifurcations(asked: Asked, json: bool) -> int:
    from towatlas.solve.device.bifurcations import bifurcations

    alpha, R = asked.alpha, asked.R
    # A device has its angle: what moves is the turn.
    found = bifurcations(asked.k, alpha=alpha) if asked.real else bifurcations(asked.k, alpha=alpha, R=R)
    rows: list[dict[str, Any]] = [
        {
            "kind": one.kind,
            "R": one.R * asked.length,
            "alpha": one.alpha,
            "phi": one.phi,
            "stable_side": one.stable_side,
            "tension": float(one.tension * asked.force(one.R)),
            "physical": bool(one.physical),
        }
        for one in found
    ]
    if json:
        print_json(rows)
    elif rows:
        head = f"{_unit('R', 'm', asked):>20} {'alpha [deg]':>20} {'phi [deg]':>12} {'stable':>7}"
        print(f"{'kind':>17} {head} {_unit('tension', 'N', asked):>14} {'taut':>5}")
        for row in rows:
            print(
                f"{row['kind']:>17} {row['R']:>20.13g} {math.degrees(row['alpha']):>20.13g} "
                f"{math.degrees(row['phi']):>12.6g} {row['stable_side'] or '-':>7} {row['tension']:>14.7g} "
                f"{_yes(row['physical']):>5}"
            )
    if found:
        return OK
    say("no bifurcation here; at +-90 degrees the device is reversible, and closed motions come in families")
    return NO_STATE


def _turn(asked: Asked, json: bool) -> int:
    from towatlas.solve.device.turning import turn

    if asked.alpha is None:
        raise ValueError("turn needs --alpha, as --alpha=-80deg")
    found = turn(asked.k, asked.alpha)
    ranges = [[low * asked.length, high * asked.length] for low, high in found.ranges]
    if json:
        print_json(
            {
                "alpha": found.alpha,
                "R_min": real(found.R_min * asked.length),
                "kind": found.kind,
                "ranges": [[real(low), real(high)] for low, high in ranges],
            }
        )
    if found.kind == "reversible":
        say("at +-90 degrees nothing damps the device: it settles in no turn")
        return NO_STATE
    if not json:
        what = {"hopf": "it begins to swing", "saddle-node": "its line goes slack"}[found.kind]
        unit = " m" if asked.real else " line lengths"
        print(f"tightest turn {ranges[0][0]:.13g}{unit}: in a tighter one {what} ({found.kind})")
        for low, high in ranges:
            print(
                f"steady from {low:.13g} to {high:.13g}{unit}"
                if high < math.inf
                else f"steady from {low:.13g}{unit} on"
            )
    return OK


def _cycle(asked: Asked, json: bool) -> int:
    from towatlas.solve.device.cycles import cycles

    k, alpha, R = _needed(asked, "cycle")
    found = cycles(k, alpha, R)
    rows: list[dict[str, Any]] = [
        {
            "amplitude": c.amplitude,
            "period": c.period * asked.time(R),
            "tension_min": float(c.tension_min * asked.force(R)),
            "stable": c.stable,
            "phi_min": c.phi_min,
            "phi_max": c.phi_max,
            "multiplier": c.multiplier,
            "slack": c.slack,
        }
        for c in found
    ]
    if json:
        print_json(rows)
    elif rows:
        names = _unit("period", "s", asked), _unit("least tension", "N", asked)
        print(f"{'amplitude [deg]':>20} {names[0]:>20} {names[1]:>20} {'stable':>7} {'phi [deg]':>22} {'slack':>7}")
        for row in rows:
            ends = f"{math.degrees(row['phi_min']):.5g} to {math.degrees(row['phi_max']):.5g}"
            print(
                f"{math.degrees(row['amplitude']):>20.13g} {row['period']:>20.13g} {row['tension_min']:>20.13g} "
                f"{_yes(row['stable']):>7} {ends:>22} {100.0 * row['slack']:>6.3g}%"
            )
    if not found:
        say(_no_cycle(alpha))
        return NO_STATE
    if all(c.slack for c in found):
        say("on every one the line goes slack, and the model ends: the device loses its line")
    return OK


def _no_cycle(alpha: float) -> str:
    if abs(alpha) >= 0.5 * math.pi:
        return "at +-90 degrees the device is reversible: closed motions come in families, and none is a limit cycle"
    if math.cos(alpha) >= 1.0 / 3.0:
        return "no limit cycle: where cos alpha >= 1/3 there is none in any turn"
    return "no limit cycle was found"


def _tangle(options: argparse.Namespace) -> int:
    from towatlas.solve.device.tangling import tangle

    if options.device is None or not (options.k is options.alpha is options.R is None):
        raise ValueError("tangle is of two lines in real units: a file DEVICE.toml with [[line]] twice, and no options")
    tow = _tow(options.device)
    if len(tow.lines) != 2:
        raise ValueError(f"{options.device}: tangle needs two sections [[line]]; this has one")
    found = tangle(*tow.lines, tow.speed)
    rows: list[dict[str, Any]] = [
        {
            "R": t.R,
            "phi": t.phi,
            "stable": list(t.stable),
            "tension": list(t.tension),
            "physical": t.physical,
        }
        for t in found
    ]
    if options.json:
        print_json(rows)
    elif rows:
        print(f"{'R [m]':>20} {'phi [deg]':>20} {'stable':>10} {'tensions [N]':>28} {'taut':>5}")
        for row in rows:
            stable = ", ".join(_yes(one) for one in row["stable"])
            forces = ", ".join(f"{one:.7g}" for one in row["tension"])
            print(
                f"{row['R']:>20.13g} {math.degrees(row['phi']):>20.13g} {stable:>10} {forces:>28} "
                f"{_yes(row['physical']):>5}"
            )
    if not found:
        say("the lines lie on one bearing in no turn")
        return NO_STATE
    if not any(t.physical for t in found):
        say("where they lie on one bearing both lines are slack: in steady turns they do not tangle")
    return OK


def _unit(name: str, unit: str, asked: Asked) -> str:
    return f"{name} [{unit}]" if asked.real else name


def _yes(value: bool) -> str:
    return "yes" if value else "no"


ANSWERS: dict[str, Callable[[Asked, bool], int]] = {
    "points": _points,
    "bifurcations": _bifurcations,
    "turn": _turn,
    "cycle": _cycle,
}
