"""Words of the page that reproduces the paper on the lateral force device."""

CAPTIONS = {
    "diagram": "The printed diagram over the angle &alpha; of the fluid's force and the turning radius R, k = 1: left "
    "whole, with the number of fixed points in each region, right near &minus;90 degrees. Every curve but those of "
    "homoclinic orbits and of saddle-nodes of cycles is a closed form or a root of one equation. The segment that "
    "the paper takes for an artefact is that of neutral saddles: the trace vanishes, but the fixed point is a saddle.",
    "crossing": "Phase portraits about the crossing of the curves of Hopf points and homoclinic orbits, k = 1, &phi; "
    "in degrees and its rate over &omega;. Full circles are stable, thick lines limit cycles, dashed where unstable; "
    "black are the manifolds of the saddles, the stable ones dashed. Shaded: the line would have to push. a, beyond "
    "the saddle-node of cycles; b, between it and the homoclinic orbit: two cycles; c, the outer one gone; d, below "
    "the Hopf point: the motion loses its line. e, f, on the other side of the crossing: two cycles, then the outer "
    "one alone.",
    "paths": "Two ways to a tighter turn, k = 1. a to c, &alpha; = &minus;80 degrees: steady, swinging, steady again, "
    "beside a cycle on a slack line. "
    "d to f, &alpha; = 0: steady, still steady, and no fixed point left, the line is lost.",
    "turns": "The tightest turn in which a device circles steadily on a taut line, for devices of different strength; "
    "shaded, a second range below. Inwards of $critical degrees, where cos &alpha; = 1/3 for every device, it "
    "begins to swing first. The axis is stretched below.",
    "bearings": "Two lines of 300 m and 150 m, each with a device of 300 kg and k = 60 kg/m, at 0.9 and 0.5 rad: where "
    "the curves cross they tangle, at R = $radius m, &phi; = $bearing rad. Dashed: unstable.",
}

MISPRINTS = (
    "The square roots of Eqs. (13) and (14) lack a term, twice the product of the rate of the line and the velocity of "
    "the ship across it; Eqs. (15) and (16) have it. With it they follow from Eqs. (1) to (10), checked at random.",
    "The scaled constant is k L/m; the printed k/(m L) has a dimension.",
    "In Eq. (26) the prefactor of Eq. (23) is left out, with its sign: cycles are born stable where it is positive.",
    "Eqs. (17), (19), (20) and (26) are right, checked against differences. At R = 1, &phi; = &minus;90 degrees, (19) "
    "and (20) are 0/0: the device rests at the centre of the turn on a slack line, a saddle of growth rates &plusmn;1.",
    "The table's value for k = 0.5 is wrong in its last digit.",
    "The segment of the Hopf curve below the Takens-Bogdanov point is no artefact of elimination: it solves the "
    "equations, as a neutral saddle. What elimination does bring in are images of &alpha; beyond 90 degrees.",
)

BODY = """\
<p>L. Ng, R. Rand and W. Keith, Dynamics of towed cables during transient motions, DETC2001/VIB-21438: a device that
holds a line aside behind a ship in a circle, a point mass on an inextensible line in a horizontal plane. The force of
the fluid is k v<sup>2</sup> at the angle &alpha; to the velocity, positive out of the turn; lengths are over that of
the line, k stands for k L/m. Figures 5 to 8 are redrawn from the program, every printed number is recomputed.</p>
<nav>
<ul>
<li><a href="#numbers">The numbers</a></li>
<li><a href="#misprints">Misprints, and what holds</a></li>
<li><a href="#figures">The figures</a></li>
</ul>
</nav>

<h2 id="numbers">The numbers</h2>
<p>The turning radius at which Hopf points change from cycles that are born stable to unstable ones, and the angle at
which the curve of Hopf points turns back, $critical degrees for every k: cos &alpha; = 1/3, where the velocity of the
device along its line is &radic;2 times that across it. $verdict</p>
$table

<h2 id="misprints">Misprints, and what holds</h2>
<ul>
$misprints</ul>
<p>Where cos &alpha; is 1/3 or more there is no limit cycle and no homoclinic orbit at any turning radius, for any
device: the divergence of the flow, &minus;k S (3 cos &alpha; + cos(2&psi; + &alpha;))/2 with the velocity S in
direction &psi;, has one sign, which is Bendixson's criterion.</p>

<h2 id="figures">The figures</h2>
$figures
"""
