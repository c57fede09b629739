"""Words of the page that reproduces DTMB Report 713."""

CAPTIONS = {
    "fig3": "Fig. 3: <i>C</i><sub>n</sub>/sin<sup>2</sup>&phi; against &phi;. Line: mean, as in the report; band: one "
    "standard deviation of a point. Behind &plusmn; stands the standard error of the mean.",
    "fig4": "Fig. 4: <i>C</i><sub>s</sub> against sin &phi;. The report gives no law; here "
    "<i>C</i><sub>s</sub> = <i>a</i> <i>s</i> / (1 + (<i>s</i>/<i>b</i>)<sup>2</sup>), <i>s</i> = sin &phi;, by least "
    "squares, broken where there are no points, with its maximum (triangle). It is linear at first and has one "
    "maximum, as the report says of the force; between, it is a choice. Of H, whose fit has no maximum, a line.",
    "fig5": "Fig. 5: <i>C</i><sub>n</sub>/sin &phi; against sin &phi;. The report has a typical one and the "
    "copy at hand does not say of which cable; here are all. Solid: line through the origin; "
    "broken: <i>A</i> + <i>B</i> sin &phi;.",
    "directions": "Angle below the stream (circles) and to starboard (squares) as measured, against the speed; by the "
    "laws of each cable (solid); and the angle below the stream without side force (broken). The program tows each "
    "cable alone on a circle of 1000 km, at the speed of every row.",
}

# What is wrong in the words and equations of the report, or in this copy of it: place, printed, right.
SLIPS = (
    ("Table 1, column 5, A to D", "weights of 0.0436 to 0.047 lb", "ten times as much: column 6 times column 3"),
    (
        "Results, on Table 1",
        "the weights of B, C and H in column 5 are from stock",
        "column 7, which has the asterisks",
    ),
    (
        "Eq. (6), middle member",
        "without <i>l</i>",
        "&minus;<i>w l m</i>/sin &phi;, which is &minus;<i>w m</i> cot &phi;",
    ),
    ("Table 2, heads of cables G and H", "<i>C</i><sub>B</sub>", "<i>C</i><sub>s</sub>"),
    ("Results, above Table 3", "<i>C</i><sub>p</sub>", "<i>C</i><sub>r</sub>"),
    ("Results, below Table 3", "&delta; affects only <i>C</i><sub>r</sub>", "only <i>C</i><sub>f</sub>, Eq. (10a)"),
    ("Discussion, on Fig. 5", "plotted against &phi;", "against sin &phi;, as its caption says"),
)

# $ marks what `towatlas.report.dtmb713.page` fills in.
BODY = """\
<p>Leonard Pode, <cite>An Experimental Investigation of the Hydrodynamic Forces on Stranded Cables</cite>, David Taylor
Model Basin, 1950: the forces on eight stranded cables, from the directions in which they trail when towed. Every number
of its Table 2 that follows from others is recomputed, its figures are drawn anew, and what it says is held against its
own numbers. &phi; is the angle between cable and stream, <i>l</i>, <i>m</i>, <i>n</i> are the direction cosines along
the stream, downwards and to starboard; <i>C</i><sub>n</sub>, <i>C</i><sub>s</sub>, <i>C</i><sub>f</sub> the
coefficients of the force across the cable in the plane of cable and stream, across that plane, and along the cable, all
on the diameter.</p>
$verdict
<nav>
<ul>
<li><a href="#claims">What it says, and what holds</a></li>
<li><a href="#laws">The laws of the cables</a></li>
<li><a href="#figures">The figures</a></li>
<li><a href="#trail">How the cables trail</a></li>
<li><a href="#table1">Tables 1 and 3</a></li>
<li><a href="#misprints">Misprints</a></li>
<li><a href="#table2">Table 2, row by row</a></li>
</ul>
</nav>

<h2 id="claims">What it says, and what holds</h2>
<p>The statements are in other words; each verdict is computed. A coefficient is called clearly different from 0 beyond
four standard errors.</p>
$claims

<h2 id="laws">The laws of the cables</h2>
<p>From the rows of Table 2, two misprints mended. <i>C</i><sub>r</sub> is the mean of
<i>C</i><sub>n</sub>/sin<sup>2</sup>&phi;, <i>a</i> and <i>b</i> are fitted by least squares to <i>C</i><sub>s</sub> =
<i>a</i> <i>s</i> / (1 + (<i>s</i>/<i>b</i>)<sup>2</sup>), <i>s</i> = sin &phi;. Behind &plusmn; stand standard errors,
in parentheses the standard deviation of one point. These are the laws of the cable types pode-A to pode-H of the
program, which rounds them. They hold for the angles measured, $range degrees; what the side force does beyond is
extrapolation.</p>
$laws
<p>All points have the cable to starboard of the track. The report does not say which lay the cables had.</p>

<h2 id="figures">The figures</h2>
$figures

<h2 id="trail">How the cables trail</h2>
$directions

<h2 id="table1">Tables 1 and 3</h2>
<p>Weights over the length recomputed from columns 5 and 3, and the density of the wire that the weights in air and in
water imply: solid steel has about 490 lb/ft<sup>3</sup>. The two weights are two years of corrosion apart, and those of
B, C and H in water are of similar cables.</p>
$table1
<p>Table 3, the averages of <i>C</i><sub>n</sub>/sin<sup>2</sup>&phi;:</p>
$table3

<h2 id="misprints">Misprints</h2>
<p>In the report or in the copy of it at hand. In Table 2 the other numbers of the row decide.</p>
$misprints

<h2 id="table2">Table 2, row by row</h2>
<p>As printed. Each column that follows from others is recomputed from them: $follows. The density of the water is not
printed; $density slug/ft<sup>3</sup> gives the coefficients back. A number is shaded, with the recomputed one below it,
where rounding of all that goes into it does not explain the difference. $norm $slips</p>
$table2"""
