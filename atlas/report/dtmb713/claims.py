"""The statements of DTMB Report 713, each with what holds by its own numbers."""

import numpy as np

from towatlas.report.claims import FAILS, HOLDS, PART, Claim, judged
from towatlas.report.dtmb713.data import KNOT, LETTERS, TABLE_3, points
from towatlas.report.dtmb713.directions import all_directions
from towatlas.report.dtmb713.fits import apparent_sine_term, bend, normal_force, side_force, sine_term
from towatlas.report.frame import number

# Beyond this a coefficient over its standard error is called different from 0.
CLEAR = 4.0
# Of water [ft^2/s], at 15 degrees C.
VISCOSITY = 1.23e-5
# Ranges of phi that the report speaks of [deg], and whether C_n / sin^2(phi) is above its mean there.
RANGES = ((1.0, 2.5, True), (2.5, 6.0, False), (6.0, 9.5, True))


def all_claims() -> list[Claim]:
    """In the order in which the report comes to them.

    Returns
    -------
    list of Claim
    """
    return [
        _straight(),
        _reynolds(),
        _means(),
        _weights(),
        _square_law(),
        _ranges(),
        _no_sine_term(),
        _curved(),
        _yaw(),
        _closer(),
        _linear_at_first(),
        _maximum(),
        _differ(),
        _tangential_size(),
        _tangential_speed(),
        _tangential_diameter(),
    ]


def _by_cable(values: dict[str, float], form: str) -> str:
    return ", ".join(f"{letter} {number(value, form)}" for letter, value in values.items())


def _named(letters: list[str]) -> str:
    return ", ".join(letters) if letters else "none"


def _straight() -> Claim:
    found = all_directions()
    rms = {letter: found[letter].rms_deg for letter in LETTERS}
    return Claim(
        "Theory",
        "A uniform flexible cable towed freely is a straight line whose direction the normal and side force and the "
        "weight decide.",
        judged(value < 1.0 for value in rms.values()),
        "With the laws fitted below the program's cable, alone on a circle of 1000 km, trails as each was measured, "
        f"within {min(rms.values()):.2f} to {max(rms.values()):.2f} degrees rms a cable.",
    )


def _reynolds() -> Claim:
    together = {letter: np.corrcoef(points(letter).speed, points(letter).phi_deg)[0, 1] for letter in LETTERS}
    reach = [points(c).speed[[0, -1]] * KNOT * points(c).diameter / VISCOSITY for c in LETTERS]
    low, high = min(r[0] for r in reach), max(r[1] for r in reach)
    return Claim(
        "Theory",
        "Each angle is investigated at another Reynolds number, since only the speed can change the angle.",
        judged(value < -0.9 for value in together.values()),
        f"Angle and speed go together: correlation {number(max(together.values()), '.2f')} to "
        f"{number(min(together.values()), '.2f')}. On the diameter the Reynolds number is {low:,.0f} to {high:,.0f}; "
        "what is law of the angle and what of the speed these tests cannot tell.",
    )


def _means() -> Claim:
    right = [abs(normal_force(c).value - float(TABLE_3[c])) <= 0.005 * (1.0 + 1e-9) for c in LETTERS]
    return Claim(
        "Table 3",
        "<i>C</i><sub>r</sub> of each cable is the average of <i>C</i><sub>n</sub>/sin<sup>2</sup>&phi;.",
        judged(right),
        f"Plain means of the printed column give {sum(right)} of the {len(right)} values as printed.",
    )


def _weights() -> Claim:
    changes = []
    for letter in LETTERS:
        data = points(letter)
        along = data.delta / data.l
        own = data.weight * data.m
        changes.append(-0.1 * own / (along - own))
    most = float(np.abs(np.concatenate(changes)).max())
    return Claim(
        "Results",
        "A wrong weight changes <i>C</i><sub>n</sub> and <i>C</i><sub>s</sub> by one percentage, so that their "
        "variation with the angle stays; a wrong &delta; changes one coefficient only.",
        HOLDS,
        "By Eqs. (7), (8) and (10) both are proportional to the weight and free of &delta;. <i>C</i><sub>f</sub> is "
        f"not: 10 % more weight lowers it, by up to {100 * most:.1f} %, more where the cable is steep.",
    )


def _square_law() -> Claim:
    shares = {c: normal_force(c).sd / normal_force(c).value for c in LETTERS}
    return Claim(
        "Abstract, Discussion",
        "The normal force goes with sin<sup>2</sup>&phi;.",
        judged(share < 0.3 for share in shares.values()),
        "Standard deviation of one point about the mean of its cable, in percent: "
        f"{_by_cable({c: 100 * share for c, share in shares.items()}, '.0f')}.",
    )


def _ranges() -> Claim:
    phi = np.concatenate([points(c).phi_deg for c in LETTERS])
    over = np.concatenate([points(c).ratio / normal_force(c).value for c in LETTERS])
    kept, words = [], []
    for low, high, above in RANGES:
        here = over[(phi >= low) & (phi < high)]
        kept.append((here.mean() > 1.0) == above)
        side = np.sum(here > 1.0) if above else np.sum(here < 1.0)
        words.append(
            f"{low:g} to {high:g} degrees: {here.mean():.2f} of the mean of the cable, "
            f"{side} of {len(here)} {'above' if above else 'below'} it"
        )
    one = points("A")
    steep = float(one.ratio[one.phi_deg >= 6.0].mean()) / normal_force("A").value
    return Claim(
        "Discussion",
        "<i>C</i><sub>n</sub>/sin<sup>2</sup>&phi; tends to be above its average from 1 to 2.5 degrees, below it to 6, "
        "and above it again to 9.",
        judged(kept),
        f"{'; '.join(words)}. Of the cables alone not all do so: A has {steep:.2f} beyond 6 degrees.",
    )


def _no_sine_term() -> Claim:
    t = {c: float(sine_term(c).t[0]) for c in LETTERS}
    clear = [c for c in LETTERS if abs(t[c]) >= CLEAR]
    return Claim(
        "Discussion, Conclusions",
        "There is no sign of a term with sin&phi;: a straight line through the origin fits "
        "<i>C</i><sub>n</sub>/sin&phi; as well as any other.",
        judged(abs(value) < CLEAR for value in t.values()),
        f"<i>A</i> of <i>A</i> + <i>B</i> sin&phi; over its standard error: {_by_cable(t, '.1f')}. It differs clearly "
        f"from 0 for {_named(clear)}; A has {len(points('A'))} points.",
    )


def _curved() -> Claim:
    t = {c: float(bend(c).t[1]) for c in LETTERS}
    better = {c: 1.0 - bend(c).sd / sine_term(c).sd for c in LETTERS}
    gain = [c for c in LETTERS if better[c] > 0.05]
    return Claim(
        "Discussion",
        "Only a curve would fit <i>C</i><sub>n</sub>/sin&phi; considerably better.",
        judged(c in gain for c in LETTERS),
        "A parabola through the origin, with as many coefficients as the line <i>A</i> + <i>B</i> sin&phi;, lessens "
        f"the standard deviation by 5 % or more for {_named(gain)}. Its bend over its standard error: "
        f"{_by_cable(t, '.1f')}. The signs differ: no one curve mends the law.",
    )


def _yaw() -> Claim:
    t = {c: float(apparent_sine_term(c).t[0]) for c in LETTERS}
    size = {c: float(apparent_sine_term(c).values[0]) for c in LETTERS}
    true = {c: float(sine_term(c).values[0]) for c in LETTERS}
    worse = [t[c] > CLEAR and abs(size[c]) > abs(true[c]) for c in LETTERS]
    return Claim(
        "Discussion",
        "The term with sin&phi; of the first analysis came from neglecting side force and yaw.",
        judged(worse),
        f"From the angle in the vertical plane alone, as who does not see the yaw has it, {sum(worse)} of "
        f"{len(worse)} get one, <i>A</i> by cable {_by_cable(size, '.2f')}: {number(min(t.values()), '.0f')} to "
        f"{number(max(t.values()), '.0f')} standard errors; with the yaw it is {_by_cable(true, '.3f')}.",
    )


def _closer() -> Claim:
    found = all_directions()
    deep = {c: float(found[c].too_deep_deg.mean()) for c in LETTERS}
    return Claim(
        "Theory, Discussion",
        "The side force lifts: stranded cables often tow closer to the surface than smooth ones.",
        judged(value > 0.0 for value in deep.values()),
        f"Without it the cables would tow deeper by, in degrees on average: {_by_cable(deep, '.1f')}.",
    )


def _linear_at_first() -> Claim:
    low, text = [], []
    for letter in LETTERS:
        data, law = points(letter), side_force(letter)
        at = float(data.sin_phi.min())
        low.append(float(law.at(np.array([at]))[0]) / (law.a * at))
        text.append(f"{letter} {low[-1]:.2f}")
    return Claim(
        "Discussion, Conclusions",
        "At very small angles the side force is proportional to sin&phi;.",
        PART if min(low) < 0.9 else HOLDS,
        "The fitted law over its tangent at the smallest angle measured: "
        f"{', '.join(text)}. Where this is 1 the proportional range was reached; that of A, and hardly that of B to D, "
        "was not.",
    )


def _maximum() -> Claim:
    inside = [c for c in LETTERS if side_force(c).b < points(c).sin_phi.max()]
    beyond = [c for c in LETTERS if points(c).sin_phi.max() <= side_force(c).b < np.inf]
    never = [c for c in LETTERS if side_force(c).b == np.inf]
    steeper = ", ".join(f"{-side_force(c).bend / side_force(c).bend_error:.1f} standard errors" for c in never)
    return Claim(
        "Abstract, Discussion",
        "In most cases <i>C</i><sub>s</sub> reaches a maximum within the range of angles, in the others it levels off.",
        PART if len(inside) <= len(LETTERS) // 2 or never else HOLDS,
        f"By the fits within the range for {_named(inside)}, {len(inside)} of {len(LETTERS)}; just beyond it for "
        f"{_named(beyond)}, which level off; {_named(never)} does not: its points bend upwards (by {steeper}).",
    )


def _differ() -> Claim:
    laws = [side_force(c) for c in LETTERS]
    least, most = min(laws, key=lambda law: law.a), max(laws, key=lambda law: law.a)
    spread = (most.a - least.a) / np.hypot(most.a_error, least.a_error)
    same = abs(laws[1].a - laws[2].a) / np.hypot(laws[1].a_error, laws[2].a_error)
    pair = abs(laws[5].a - laws[6].a) / np.hypot(laws[5].a_error, laws[6].a_error)
    return Claim(
        "Discussion",
        "The slope at small angles and the place of the maximum depend on size and construction of the cable.",
        judged([spread > CLEAR]),
        f"<i>a</i> goes from {least.a:.3f} to {most.a:.3f}, {spread:.1f} standard errors. They are not all of it: B "
        f"and C, alike, agree ({same:.1f} standard errors apart), F and G, alike too, do not ({pair:.1f}).",
    )


def _tangential_size() -> Claim:
    over = {c: points(c).C_f / normal_force(c).value for c in LETTERS}
    low, high = min(v.min() for v in over.values()), max(v.max() for v in over.values())
    return Claim(
        "Discussion",
        "<i>C</i><sub>f</sub> is of the order of 0.02 <i>C</i><sub>r</sub>.",
        judged([low > 0.01, high < 0.04]),
        f"<i>C</i><sub>f</sub>/<i>C</i><sub>r</sub> is {low:.4f} to {high:.4f} in all rows; medians: "
        f"{_by_cable({c: float(np.median(v)) for c, v in over.items()}, '.4f')}.",
    )


def _tangential_speed() -> Claim:
    t = {}
    for c in LETTERS:
        data = points(c)
        x = np.log(data.speed)
        t[c] = -float(np.polyfit(x, np.log(data.C_f), 1)[0])
    return Claim(
        "Discussion",
        "<i>C</i><sub>f</sub> falls with the speed.",
        judged(value > 0.0 for value in t.values()),
        f"About with the speed to the power of minus: {_by_cable(t, '.2f')}.",
    )


def _tangential_diameter() -> Claim:
    speeds = (8.0, 9.0)
    sizes = {"1/16": "ABCD", "1/8": "EFG", "1/4": "H"}
    means = [
        float(np.mean([np.interp(speeds, points(c).speed, points(c).C_f) for c in letters]))
        for letters in sizes.values()
    ]
    words = ", ".join(f"{size} in {value:.4f}" for size, value in zip(sizes, means, strict=True))
    falls = [means[k + 1] < 0.98 * means[k] for k in range(len(means) - 1)]
    return Claim(
        "Discussion",
        "<i>C</i><sub>f</sub> falls with the diameter.",
        judged(falls) if any(falls) else FAILS,
        f"At 8 to 9 kn, which all eight were towed at: {words}.",
    )
