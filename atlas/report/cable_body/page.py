"""The text on a cable-body system reproduced in one page: statements, figures, several shapes, its 27 combinations."""

from collections.abc import Callable
from string import Template

from matplotlib.figure import Figure

from towatlas.effort import check_patience
from towatlas.report import frame
from towatlas.report.cable_body import figures
from towatlas.report.cable_body.claims import SYSTEMS, all_claims
from towatlas.report.cable_body.several import (
    AIR_DRAWN,
    AIR_SPEEDS,
    AIR_TANGENTIAL,
    FAST,
    FASTER,
    JUMP_RATIO,
    RADII,
    STRANDED,
    Array,
    Window,
    cusp,
    jumps,
    small_window,
    window,
    window_without_inertia,
)
from towatlas.report.cable_body.systems import (
    LONGEST,
    RADIUS,
    TABLE_1,
    TANGENTIAL,
    curve,
    folds_in_length,
    make_system,
)
from towatlas.report.cable_body.text import BODY, CAPTIONS, READINGS
from towatlas.report.claims import FAILS, HOLDS, Claim, claims_table
from towatlas.report.frame import number, table

TITLE = "A cable and body towed in a circle in water, reproduced"
REMEDY = "there is no smaller page"
DRAWN: dict[str, tuple[str, Callable[[Figure], None]]] = {
    "fig3": ("Fig. 3. Three speeds", figures.draw_speeds),
    "fig4": ("Fig. 4. Three bodies", figures.draw_weights),
    "water": ("Three shapes in water", figures.draw_water),
    "air": ("Three shapes in air", figures.draw_air),
}
AT = (1.0, 4.0)


def report_page() -> str:
    """The page, as HTML with inline figures and nothing from elsewhere.

    Returns
    -------
    str
    """
    bare = {}
    for k, system in enumerate(SYSTEMS):
        check_patience("systems of the page", REMEDY, done=k, of=len(SYSTEMS))
        curve(*system)
        scene = make_system(*system, tangential=0.0)
        bare[system] = folds_in_length(scene.system("water"), scene.gamma)
    claims = all_claims()
    drawn = {}
    for k, name in enumerate(DRAWN):
        check_patience("figures of the page", REMEDY, done=k, of=len(DRAWN))
        drawn[name] = _figure(name)
    several = [system for system, found in bare.items() if len(found)]
    strong = [make_system(*system).system("water").C for system in SYSTEMS]
    made, origins = jumps()
    body = Template(BODY).substitute(
        verdict=_verdict(claims),
        readings="".join(f"<li>{reading}</li>\n" for reading in READINGS),
        claims=claims_table(claims),
        figures=drawn["fig3"] + drawn["fig4"],
        constants=f"<i>C</i> = {min(strong):,.0f} to {max(strong):,.0f}",
        origins=" and ".join(sorted(set(origins))),
        bare=len(several),
        systems=len(SYSTEMS),
        which="; ".join(f"{_named(system)}, L/R = {_range(bare[system])}" for system in several),
        tangential=f"{TANGENTIAL:g}",
        windows=_windows(),
        cusps="; ".join(f"{cusp(r)[1]:.4f} at {r:,.0f} ft (L/R = {cusp(r)[0]:.4f})" for r in _bent()),
        stranded=f"{STRANDED:g}",
        faster=f"{FASTER:g}",
        small=_range(small_window(), 4),
        water=drawn["water"],
        jumps="; ".join(
            f"{'rising' if jump.rising else 'falling'} through {jump.speed:.3f} kn the body goes from "
            f"{jump.depth[0]:.2f} to {jump.depth[1]:.2f} km of depth, from {jump.radius[0]:.2f} to "
            f"{jump.radius[1]:.2f} km off the axis"
            for jump in sorted(made, key=lambda jump: not jump.rising)
        ),
        aircraft=_aircraft(),
        air=drawn["air"],
        longest=f"{LONGEST:g}",
        table1=_table_1(),
    )
    return frame.page(TITLE, body)


def _figure(name: str) -> str:
    title, draw = DRAWN[name]
    caption = Template(CAPTIONS[name]).substitute(ratio=f"{JUMP_RATIO:g}", speed=f"{AIR_DRAWN:g}")
    return frame.figure(name, title, frame.svg(name, title, figures.SIZES[name], draw), caption)


def _verdict(claims: list[Claim]) -> str:
    kept, failed = (sum(claim.verdict == verdict for claim in claims) for verdict in (HOLDS, FAILS))
    most = max(curve(*system).most for system in SYSTEMS)
    shapes = "one shape" if most == 1 else f"up to {most} shapes"
    return (
        f"<p>Of {len(claims)} statements {kept} hold, {len(claims) - kept - failed} in part, {failed} do not. With the "
        f"coefficients of the text all {len(SYSTEMS)} systems, Table 1 and its speeds and weights at {RADIUS:g} ft, "
        f"have {shapes} at every length; without drag along the cable some have three.</p>"
    )


def _named(system: tuple[float, float, float]) -> str:
    radius, speed, weight = system
    return f"{radius:,.0f} ft, {speed:g} kn, {weight:g} lbf"


def _range(folds: Array, decimals: int = 8) -> str:
    return " to ".join(number(value, f".{decimals}f") for value in folds) if len(folds) else "one shape"


def _bent() -> list[float]:
    """Radii of the systems that have a window."""
    return [radius for radius in RADII if len(window(radius, FAST, 0.0).folds)]


def _windows() -> str:
    rows = []
    for radius in RADII:
        one = window(radius, FAST, 0.0)
        slow = window_without_inertia(radius)
        rows.append(_window_row(one, _range(slow, 6)))
    for radius, speed, along in (
        (RADII[-1], FAST, STRANDED),
        (RADII[-1], FAST, TANGENTIAL),
        (RADII[-1], FASTER, STRANDED),
        (RADII[-1], FASTER, TANGENTIAL),
    ):
        rows.append(_window_row(window(radius, speed, along), ""))
    head = ("R ft", "speed kn", "strength", "along the cable", "three shapes from L/R", "without centrifugal force")
    return table(head, rows, text=())


def _window_row(one: Window, slow: str) -> tuple[str, ...]:
    return (
        f"{one.radius:,.0f}",
        f"{one.speed:g}",
        f"{one.strength:.1f}",
        f"{one.tangential:g}",
        _range(one.folds),
        slow,
    )


def _aircraft() -> str:
    rows = []
    for speed in AIR_SPEEDS:
        found = [window(RADIUS, speed, along, "air") for along in AIR_TANGENTIAL]
        rows.append((f"{speed:g}", f"{found[0].strength:.1f}", *(_range(one.folds, 4) for one in found)))
    head = ("speed kn", "strength", *(f"along the cable {along:g}" for along in AIR_TANGENTIAL))
    return table(head, rows, text=())


def _table_1() -> str:
    rows = []
    for system in TABLE_1:
        one = curve(*system)
        where, least = one.least
        cells = [f"{system[0]:,.0f}", f"{system[1]:g}", f"{system[2]:g}", f"{least:.4f}", f"{where:.2f}"]
        for ratio in AT:
            cells += [f"{one.at('verticality', ratio):.5f}", f"{one.at('radius', ratio):.5f}"]
            cells += [f"{one.at('phase_deg', ratio):.2f}", f"{one.at('tension', ratio):.4f}"]
        rows.append(cells)
    quantities = [name for ratio in AT for name in (f"Y/L<br>at {ratio:g}", "radius", "phase<br>deg", "tension")]
    head = ("R ft", "kn", "lbf", "least", "at", *quantities)
    return table(head, rows, text=())
