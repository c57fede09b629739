"""Words of the page that reproduces the text on a cable-body system."""

CAPTIONS = {
    "fig3": "Fig. 3a to f: tow radius 3000 ft, body 250 lbf. a, b: short cables; c, d: long ones. The copy at hand has "
    "the axes of f alone, which end at 6 and at 250 degrees (dotted). The phase is that of the body behind the tow "
    "point, carried along the cable and not wrapped: at 5 kn it passes 180 degrees between two and three tow radii.",
    "fig4": "Fig. 4a to d: tow radius 3000 ft, 3 kn. The axes of a, b and c are those of the text.",
    "water": "10,000 ft, 250 lbf. a: at 5 kn; where a curve bends back there are three shapes at one length. Drag "
    "along the cable straightens it, from the second coefficient on for good. b: without drag along the cable, L/R = "
    "$ratio: a body whose speed rises jumps up, one whose speed falls drops at a lower speed.",
    "air": "The cable and body of the text behind an aircraft, 3000 ft, $speed kn.",
}

READINGS = (
    "The body is a sphere of 1.2 ft <em>diameter</em>; of 1.2 ft radius it would float. Its weight is that in air, as "
    "is the 0.3 lb/ft of the cable: the text compares the two. Masses are in lb, weights in lbf of standard gravity.",
    "Its drag coefficient 0.2 is on the area of its great circle, its added mass half of what it displaces.",
    "Sea water of 1025 kg/m<sup>3</sup>.",
    "Both drag coefficients of the cable, 1.27 across and 0.062 along it, are on the diameter, as Eq. (9) has them.",
    "Table 1 has 27 combinations; the figures have another tow radius, 3000 ft, and five of its nine.",
)

# $ marks what `towatlas.report.cable_body.page` fills in.
BODY = """\
<p>A text on the steady motion of a cable and body towed in a circle by a ship, by equilibrium and shooting, with the
equations of Skop and Choo. The copy at hand has neither title nor authors, and lacks pages: most of its equations, and
Figs. 3a to e with their captions. Its figures are drawn anew by towatlas, its 27 combinations computed, and what it
says is held against that. L is the length of the cable, R the tow radius; verticality is the depth of the body over L;
tension is that at the tow point over the weight of the cable in air.</p>
$verdict
<nav>
<ul>
<li><a href="#readings">How it is read</a></li>
<li><a href="#claims">What it says, and what holds</a></li>
<li><a href="#figures">The figures</a></li>
<li><a href="#several">Several shapes: why Choo found one and Huang several</a></li>
<li><a href="#table1">Table 1: the 27 combinations</a></li>
</ul>
</nav>

<h2 id="readings">How it is read</h2>
<p>What the text leaves open, and how this page takes it:</p>
<ul>
$readings</ul>

<h2 id="claims">What it says, and what holds</h2>
<p>The statements are in other words; each verdict is computed.</p>
$claims

<h2 id="figures">The figures</h2>
$figures

<h2 id="several">Several shapes: why Choo found one and Huang several</h2>
<p>From the body up a cable is one shot: where the body is, and the speed, decide its whole shape, and where it is as
far from the axis as the tow point its length. So all shapes at one speed lie on a curve, of the place of the body over
the length. Where it only goes on to longer cables there is one shape at every length; where it turns back there are
three, and where it turns two of them meet: a fold.</p>
<p>Two kinds of folds are known. Those of a vacuum, the subject of NRL Report 7048, end as drag grows, and here it is
large, $constants. The other kind drag makes itself. The folds below are of it: they are there without any centrifugal
force, and of the two that make the hysteresis the program finds the origin in $origins, not in the vacuum.</p>
<p>Without drag along the cable $bare of the $systems systems, Table 1 and its like at 3000 ft, have three shapes at
some length: $which. With the text's coefficient, $tangential, none has. So the text, and Choo if he had such a
coefficient, finds one shape in water; the coefficient, not the water, is the reason. The table has systems of 250 lbf;
strength is the drag of a length of the cable across the flow over its weight.</p>
$windows
<p>The coefficient at which the folds meet and are gone (a cusp): $cusps. As stranded cables have about $stranded, three
shapes are possible with them as well, at a higher speed: see the line of $faster kn. Nor does it take such a circle: a
cable of 10 mm and 0.11 kg/m, with a body of 10 N in water, a coefficient of $stranded, on a circle of 300 m at 1.5 m/s
has three from L/R = $small.</p>
$water
<p>As a hysteresis: $jumps. Between these speeds there are three shapes; which of them are stable this page does not
compute.</p>
<p>In air it is the same. At the speed of an aircraft the drag of this cable over its weight is what it is in water at
that of a ship, and the folds are there, over a wider range of lengths:</p>
$aircraft
$air
<p>Huang's systems were airborne. Whether he had several shapes from this or, with little drag, from the folds of the
vacuum, the text does not say; both are open in air, and neither in water with much drag along the cable. That would
be the difference between Huang and Choo.</p>

<h2 id="table1">Table 1: the 27 combinations</h2>
<p>With the coefficients of the text; each has one shape at every length up to L/R = $longest. Least: how vertical the
cable is at its least vertical length, and that length. Then at L/R = 1 and 4 verticality, radius of the body over the
tow radius, phase and tension.</p>
$table1"""
