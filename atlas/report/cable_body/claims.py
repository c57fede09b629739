"""The statements of the text, each with what holds by the program."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from towatlas.limits import threshold_length
from towatlas.report.cable_body.systems import (
    FIRST,
    LONGEST,
    MIDDLE,
    NORMAL,
    RADIUS,
    SPEEDS,
    TABLE_1,
    WEIGHTS,
    Curve,
    curve,
    make_system,
    without_apparent_mass,
)
from towatlas.report.claims import FAILS, HOLDS, PART, Claim, judged
from towatlas.scene.models import solve_model
from towatlas.scene.scene import Scene
from towatlas.solve.equilibria import equilibria
from towatlas.solve.shapes import shape_of

Array = NDArray[np.float64]
# All 36: Table 1, and its speeds and weights at the radius of the figures.
SYSTEMS = (*TABLE_1, *((RADIUS, speed, weight) for speed in SPEEDS for weight in WEIGHTS))
# "Near" L/R = 1, as the text has it: within this factor; and a change that a reader of a figure would not see.
NEAR, SMALL = 1.25, 0.02
# Of sea water [m^2/s], at 15 degrees C; and the range of Reynolds numbers that the text gives for its C_DN.
VISCOSITY, REYNOLDS = 1.19e-6, (400.0, 1e5)
# Long cables, at which the text compares.
LONG = 10.0
POUND, WATER = 0.45359237, 1025.0


def all_claims() -> list[Claim]:
    """In the order of the text.

    Returns
    -------
    list of Claim
    """
    return [
        _several(),
        _apparent_mass(),
        _normal_drag(),
        _reynolds(),
        _side_drag(),
        _guesses(),
        _units(),
        _body(),
        _short(),
        _small_radius(),
        _phase(),
        _least_vertical(),
        _weights(),
        _long(),
        _near_axis(),
        _cable_weight(),
        _axes(),
    ]


def by_speed(fine: bool = False) -> dict[float, Curve]:
    """Curves of Fig. 3, by the speed [kn].

    Parameters
    ----------
    fine : bool
        As of `curve`.

    Returns
    -------
    dict
    """
    return {speed: curve(RADIUS, speed, FIRST, fine=fine) for speed in SPEEDS}


def by_weight(fine: bool = False) -> dict[float, Curve]:
    """Curves of Fig. 4, by the weight of the body [lbf].

    Parameters
    ----------
    fine : bool
        As of `curve`.

    Returns
    -------
    dict
    """
    return {weight: curve(RADIUS, MIDDLE, weight, fine=fine) for weight in WEIGHTS}


def _listed(values: dict[float, str], unit: str) -> str:
    return ", ".join(f"{value} at {key:g} {unit}" for key, value in values.items())


def _expected(scene: Scene) -> tuple[float, float]:
    """Radius of the body over that of the tow point, and tension at the tow point over (mu + rho A) g R."""
    found = solve_model(scene, "water").equilibria
    return float(found.r_f[found.expected]), float(found.tension[found.expected])


def _several() -> Claim:
    threshold = float(threshold_length(0.0))
    most = max(curve(*system).most for system in SYSTEMS)
    shapes = "one shape" if most == 1 else f"up to {most} shapes"
    return Claim(
        "1",
        "Huang found several shapes in air, Choo one in water, Skop in a vacuum several above a least length and a "
        "least speed.",
        HOLDS if most == 1 else PART,
        f"In a vacuum: without a body from L/R = {threshold:g} on, above the critical speeds. In water the text's own "
        f"systems have {shapes}, and owe it to the drag along the cable: without it "
        'some have three, and in air this cable has three as well. See <a href="#several">below</a>.',
    )


def _apparent_mass() -> Claim:
    changes = []
    for speed in SPEEDS:
        scene = make_system(RADIUS, speed, FIRST, ratio=2.0)
        bare, gamma = without_apparent_mass(scene), scene.gamma
        keys = {name: getattr(bare, name) for name in ("C", "m_f", "C_f", "w", "C_t")}
        found = equilibria(bare.lam, bare.w_f, gamma, **keys)
        changes.append(float(found.r_f[found.expected]) / _expected(scene)[0] - 1.0)
    most = max(abs(change) for change in changes)
    return Claim(
        "2-2",
        "The inertia of the water, the apparent mass, is important where its density is not small.",
        HOLDS if most > SMALL else FAILS,
        f"Here it is not: left out for cable and body it changes the radius of the body at L/R = 2 by at most "
        f"{100 * most:.2g} %. The ship turns too slowly: &gamma;<sup>2</sup> is "
        f"{make_system(RADIUS, SPEEDS[-1], FIRST).gamma ** 2:.2g} at most; weight and drag "
        "decide.",
    )


def _normal_drag() -> Claim:
    tension, across = {}, {}
    for speed in SPEEDS:
        radius, pull = _expected(make_system(RADIUS, speed, FIRST))
        tension[speed] = _expected(make_system(RADIUS, speed, FIRST, tangential=0.0))[1] / pull - 1.0
        smooth = make_system(RADIUS, speed, FIRST, cable={"drag_coefficient": 0.0})
        across[speed] = _expected(smooth)[0] / radius - 1.0
    return Claim(
        "2-2",
        "Drag matters as much as apparent mass, that across the cable above all.",
        judged([min(across.values()) > SMALL]),
        "More than it (above): without drag across the cable the radius of the body at L/R = 1 is larger by "
        f"{_listed({v: f'{100 * x:.0f} %' for v, x in across.items()}, 'kn')}. Drag along the cable is not small "
        "either: without it the tension at L/R = 1 is lower by "
        f"{_listed({v: f'{-100 * x:.0f} %' for v, x in tension.items()}, 'kn')}, and whether there are several shapes "
        'hangs on it (<a href="#several">below</a>).',
    )


def _reynolds() -> Claim:
    shares, highest, lowest = {}, 0.0, float("inf")
    for speed in SPEEDS:
        scene = make_system(RADIUS, speed, FIRST, ratio=LONG)
        number = _reynolds_numbers(scene)
        highest, lowest = max(highest, float(number.max())), min(lowest, float(number.min()))
        shares[speed] = float(np.mean(number < REYNOLDS[0]))
    return Claim(
        "2-2",
        f"The drag coefficient {NORMAL} across the cable is used for Reynolds numbers of the flow across it of 400 to "
        "100,000.",
        judged([highest < REYNOLDS[1], *(share < SMALL for share in shares.values())]),
        f"At L/R = {LONG:g} and {FIRST:g} lbf they are {lowest:,.0f} to {highest:,.0f}. Share of the cable below 400: "
        f"{_listed({v: f'{100 * share:.0f} %' for v, share in shares.items()}, 'kn')}.",
    )


def _reynolds_numbers(scene: Scene) -> Array:
    """Of the flow across the cable, at points evenly spaced along it."""
    found = solve_model(scene, "water").equilibria
    along = shape_of(found, found.expected, np.linspace(0.0, found.system.lam, 401))
    place = np.stack([along.x.values, along.y.values])
    # The tow point moves along y: each point at right angles to where it is.
    velocity = np.stack([-place[1], place[0], np.zeros(len(place[0]))])
    force = np.stack([along.R_x.values, along.R_y.values, along.R_z.values])
    tangent = force / np.linalg.norm(force, axis=0)
    across = velocity - tangent * np.sum(velocity * tangent, axis=0)
    return np.asarray(np.linalg.norm(across, axis=0) * scene.speed * scene.diameter / VISCOSITY)


def _side_drag() -> Claim:
    law = {"drag_coefficient": 1.23, "tangential_drag_coefficient": 0.025}
    side = {"side_force_coefficient": 0.1835, "side_force_sine": 0.1802, "kites": "starboard"}
    radius = {
        turn: _expected(make_system(RADIUS, 5.0, FIRST, ratio=2.0, cable=law | side, turn=turn))[0]
        for turn in ("port", "starboard")
    }
    plain = _expected(make_system(RADIUS, 5.0, FIRST, ratio=2.0, cable=law))[0]
    most = max(abs(r / plain - 1.0) for r in radius.values())
    return Claim(
        "2-2",
        "Drag to the side is small enough to be left out.",
        HOLDS if most < SMALL else PART,
        "Not of a stranded cable: with the law of cable G of DTMB Report 713, far beyond the angles that it was "
        f"measured at, the radius of the body at L/R = 2 and 5 kn is {radius['port']:.3f} of the tow radius in a turn "
        f"to port, {radius['starboard']:.3f} to starboard, {plain:.3f} without. Of a smooth cable it is 0.",
    )


def _guesses() -> Claim:
    most = max(curve(*system).most for system in SYSTEMS)
    return Claim(
        "2-5",
        "One number, the radius of the body, is guessed until the tow radius comes out; sometimes several do.",
        HOLDS if most > 1 else PART,
        f"It is one number. Several do in none of the {len(SYSTEMS)} systems, the 27 of Table 1 and their like at "
        f"{RADIUS:g} ft, up to L/R = {LONGEST:g}, with the coefficients of the text.",
    )


def _units() -> Claim:
    right = {"0.447 kg/m": 0.3 * POUND / 0.3048, "1.27 cm": 0.5 * 2.54, "36.58 cm": 1.2 * 30.48}
    kept = [text.split()[0] == f"{value:.{len(text.split()[0].partition('.')[2])}f}" for text, value in right.items()]
    return Claim(
        "3",
        "0.3 lb/ft is 0.447 kg/m, 1/2 in is 1.27 cm, 1.2 ft is 36.58 cm.",
        judged(kept),
        f"0.3 lb/ft is {right['0.447 kg/m']:.4f} kg/m; the others are right.",
    )


def _body() -> Claim:
    weight = {size: np.pi / 6.0 * (size * 1.2 * 0.3048) ** 3 * WATER / POUND for size in (1.0, 2.0)}
    return Claim(
        "3",
        "The body is a sphere of 1.2 ft radius that weighs 250 lb.",
        HOLDS if weight[2.0] < FIRST else FAILS,
        f"It would displace {weight[2.0]:.0f} lb of sea water, and float. The figures have 1.2 ft as its diameter, "
        f"which displaces {weight[1.0]:.0f} lb; so it is read here.",
    )


def _short() -> Claim:
    curves = by_speed(fine=True)
    inward, less, ends = [], [], {}
    for speed, one in curves.items():
        short = one.ratio <= 1.0
        inward.append(bool((np.diff(one.radius[short]) < 0.0).all()))
        ends[speed] = f"{one.least[0]:.2f}"
        less.append(one.least[0] >= 1.0)
    return Claim(
        "4.1, Fig. 3a, b",
        "Of a cable shorter than the tow radius: the longer, the less vertical, and the nearer the body to the axis.",
        judged([*inward, *less]),
        f"The body moves inwards at {sum(inward)} of {len(inward)} speeds. The cable is least vertical at L/R = "
        f"{_listed(ends, 'kn')}; from there to 1 it rises again, by less than "
        f"{100 * max(one.at('verticality', 1.0) - one.least[1] for one in curves.values() if one.least[0] < 1.0):.1f} "
        "% of its length.",
    )


def _small_radius() -> Claim:
    one = by_speed(fine=True)[MIDDLE]
    ratios = (0.1, 1.0, LONG)
    words = "; ".join(f"L/R = {x:g}: {one.at('radius', x):.2f} and {one.at('verticality', x):.2f}" for x in ratios)
    return Claim(
        "4.1",
        "A small radius of the body does not always go with a large one of the phase or of the verticality (the "
        "sentence is cut off).",
        judged(
            [one.at("radius", 1.0) < one.at("radius", 0.1) and one.at("verticality", 1.0) < one.at("verticality", 0.1)]
        ),
        f"Radius over tow radius and verticality at {MIDDLE:g} kn, {words}: up to L/R near 1 both fall, beyond one "
        "falls and the other rises. The phase grows throughout.",
    )


def _phase() -> Claim:
    curves = by_speed(fine=True)
    longer = [bool((np.diff(one.phase_deg) > 0.0).all()) for one in curves.values()]
    stacked = np.array([one.phase_deg for one in curves.values()])
    faster = bool((np.diff(stacked, axis=0) > 0.0).all())
    ends = {speed: f"{one.at('phase_deg', LONG):.0f} degrees" for speed, one in curves.items()}
    return Claim(
        "4.1, Fig. 3f",
        "The phase grows with the speed and with the length.",
        judged([*longer, faster]),
        f"At every length up to L/R = {LONGEST:g}; at {LONG:g} it is {_listed(ends, 'kn')}.",
    )


def _least_vertical() -> Claim:
    ends = {weight: one.least[0] for weight, one in by_weight(fine=True).items()}
    others = {system: curve(*system).least[0] for system in SYSTEMS}
    fast = [x for (_, speed, _), x in others.items() if speed > 1.0]
    slow = [x for (_, speed, _), x in others.items() if speed == 1.0]
    return Claim(
        "4.2, Fig. 4a",
        "The cable is least vertical near L/R = 1, whatever the weight of the body.",
        judged(1.0 / NEAR <= x <= NEAR for x in ends.values()),
        f"At L/R = {_listed({w: f'{x:.2f}' for w, x in ends.items()}, 'lbf')}. Of all {len(SYSTEMS)} systems at 3 and "
        f"5 kn between {min(fast):.2f} and {max(fast):.2f}; at 1 kn, where it does not hold, {min(slow):.2f} to "
        f"{max(slow):.2f}.",
    )


def _weights() -> Claim:
    curves = by_weight(fine=True)
    light, heavy = curves[WEIGHTS[0]], curves[WEIGHTS[-1]]
    ratios = (1.0, 2.0, 4.0, LONG)
    apart = {x: heavy.at("verticality", x) / light.at("verticality", x) - 1.0 for x in ratios}
    words = ", ".join(f"{100 * change:.1f} % at L/R = {x:g}" for x, change in apart.items())
    falls = all(apart[a] > apart[b] for a, b in pairwise(ratios))
    return Claim(
        "4.2",
        "The weight of the body matters little, least for long cables.",
        judged([falls, apart[4.0] < 0.1, apart[1.0] < 0.1]),
        f"Four times the weight makes the cable more vertical by {words}.",
    )


def _long() -> Claim:
    kept, words = [], {}
    for speed, one in by_speed(fine=True).items():
        beyond = one.ratio > max(one.least[0] + 0.1, 1.0)
        kept.append(bool((np.diff(one.verticality[beyond]) > 0).all() and (np.diff(one.radius[beyond]) < 0).all()))
        words[speed] = f"{one.at('radius', LONG):.3f} and {one.at('verticality', LONG):.3f}"
    return Claim(
        "4.1, 4.2, Figs. 3c, d, 4b",
        "Of a long cable a small radius of the body goes with a large verticality.",
        judged(kept),
        f"Beyond the least vertical length the one falls and the other rises, without end. At L/R = {LONG:g}: "
        f"{_listed(words, 'kn')}.",
    )


def _near_axis() -> Claim:
    radius = {speed: one.at("radius", LONG) for speed, one in by_speed(fine=True).items()}
    slower = list(radius.values()) == sorted(radius.values())
    return Claim(
        "4.2",
        "Since the speed is low, the body of a long cable stays very near the axis.",
        HOLDS if slower else PART,
        f"Near it is, at L/R = {LONG:g}: {_listed({v: f'{r:.3f}' for v, r in radius.items()}, 'kn')}, in tow radii. "
        "But the faster the nearer: it is drag, not slowness, that draws it there.",
    )


def _cable_weight() -> Claim:
    scene = make_system(RADIUS, MIDDLE, WEIGHTS[-1])
    air = scene.mass_per_length * scene.length / POUND
    wet = (scene.mass_per_length - scene.displaced_per_length) * scene.length / POUND
    body = (scene.fish_mass - scene.fish_displaced) / POUND
    return Claim(
        "4.2, Fig. 4c, d",
        "As long as the tow radius the cable weighs 900 lb in air, close to the heaviest body of 1000 lb.",
        judged([abs(air - 900.0) < 0.5]),
        f"{air:.0f} lb. In water it is {wet:.0f} lb beside {body:.0f}.",
    )


def _axes() -> Claim:
    fastest = curve(RADIUS, SPEEDS[-1], FIRST, fine=True)
    phase, passed = fastest.at("phase_deg", 6.0), float(np.interp(250.0, fastest.phase_deg, fastest.ratio))
    heavy = curve(RADIUS, MIDDLE, WEIGHTS[-1], fine=True).at("tension", 0.1)
    low = min(one.least[1] for one in by_weight(fine=True).values())
    return Claim(
        "Figs. 3f, 4a, 4c",
        "The axes end at L/R = 6 and 250 degrees, at a verticality of 0.4, at a tension of 10 cable weights.",
        judged([phase <= 250.0, low >= 0.4]),
        f"At 5 kn the phase passes 250 degrees at L/R = {passed:.2f} and is {phase:.1f} at 6. The least verticality of "
        f"Fig. 4a is {low:.3f}; the tension of Fig. 4c comes down to 10 just above L/R = 0.1, where it is {heavy:.1f}.",
    )
