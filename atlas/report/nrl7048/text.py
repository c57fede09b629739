"""Words of the page that reproduces NRL Report 7048."""

CAPTIONS = {
    9: "The length of cable up to which no shape has a node, Eq. (36): &lambda;<sub>c</sub> = 1 &minus; "
    "<i>w</i><sub>f</sub> + &radic;(1 + <i>w</i><sub>f</sub><sup>2</sup>). The report reads it from the bounds "
    "of Eq. (35) and confirms it by many solution curves; here it is also where the first critical speed goes "
    "to infinity.",
    10: "Boundary error at the fish for every guess of <i>R</i><sub>x0</sub> that Eq. (35) allows, at high speed. "
    "Each curve crosses zero once, at a shape that swings outwards, and the report concludes that a cable this "
    "short has no other shape at any speed.",
    11: "The one shape of a cable without a fish, as long as the threshold, in true proportions: <i>x</i> grows "
    "all the way from the tow point. The value of <i>R</i><sub>x0</sub> that the report prints with it is not "
    "a root (see the numbers above).",
    12: "As Fig. 10, for a cable longer than its threshold by 0.1. At the two lower speeds the hump at the left "
    "end stays below zero; at &gamma; = 6.2 it has risen above, and two more roots exist (enlarged). The "
    "report takes the speed at which the hump touches zero for the first critical speed.",
    13: "The two shapes that have appeared at &gamma; = 6.2, in true proportions: both lie flat, cross the axis "
    "once and end beyond it. The report takes them as proof that cables longer than the threshold do have "
    "shapes with a node.",
    14: "As Fig. 12, for a long cable. There are three roots at &gamma; = 0.5 (enlarged), just past the first "
    "tangency, three at 1.0 and five at 1.5: each new pair appears beside the median root, on its left, and "
    "its right member is the new median root. The report expects that one to be the shape that is seen.",
    15: "The two shapes with two nodes at &gamma; = 1.5, in true proportions. That of <i>R</i><sup>dr</sup>, the "
    "median root, hangs deeper and closer to the axis.",
    16: "Solution curves of the cable photographed in Fig. 3, at the speeds of the photographs. The outermost "
    "roots are a cable flung straight out; the photographed shapes belong to those in the middle, which at "
    "&gamma; = 5.94 share 0.3 % of the range and are enlarged twice, since one of them all but coincides with "
    "the root of &gamma; = 2.97.",
    17: "Shapes of the median roots of Fig. 16, in true proportions: one node, one node, two nodes, the last of "
    "them just above the fish. The report holds them against the photographs of Fig. 3, finds them alike, and "
    "takes that as evidence for the median root.",
}

# $ marks what `towatlas.report.nrl7048.page` fills in.
BODY = """\
<p>R. A. Skop, <cite>On the Shape of a Cable Towed in a Circular Path</cite>, Naval Research Laboratory, 1970: each of
its figures of the cable in a vacuum, drawn anew by towatlas, and each number that it prints beside the same number
recomputed. Lengths are over the tow radius <i>R</i>, forces over (&mu; + &rho;<i>A</i>) <i>g</i> <i>R</i>; &lambda;
is the length of the cable, <i>w</i><sub>f</sub> the weight of the fish, &gamma; = &Omega; &radic;(<i>R</i>/<i>g</i>)
the speed and <i>R</i><sub>x0</sub> the radial force of the cable at the tow point.</p>
$verdict
<nav>
<ul>
<li><a href="#numbers">The numbers</a></li>
$contents<li><a href="#photographs">The photographs</a></li>
<li><a href="#lasting">Which shapes last</a></li>
<li><a href="#interpretation">The interpretation</a></li>
</ul>
</nav>

<h2 id="numbers">The numbers</h2>
<p>A value agrees if every printed digit is right. A sign ~ marks a value that the report gives as approximate, &lt;
and &gt; one that it gives as a bound. The difference is recomputed less printed. Where another method explains it, such
as the report's own Runge-Kutta (RK4), the value that this gives stands beside. Rows that differ are shaded.</p>
<div class="wide"><table class="numbers">
<thead><tr><th scope="col">Place</th><th scope="col">Quantity</th><th scope="col" class="n">Printed</th>
<th scope="col" class="n">Recomputed</th><th scope="col" class="n">Difference</th>
<th scope="col" class="n">Explained by</th><th scope="col">Explanation</th></tr></thead>
<tbody>
$numbers</tbody></table></div>

<h2 id="figures">The figures</h2>
<p>Solution curves are forward shots, Eqs. (29) and (33), by the report's Runge-Kutta method with $drawn_segments
segments in place of $segments. The report does not state the ranges of its axes; here each curve runs from the lower to
the upper bound of Eq. (35), at the short bars. Circles are the equilibria, found from the fish up without the curves;
their names are the report's: <i>a</i> for no node, <i>b</i> for one, <i>d</i> for two, <i>l</i> and <i>r</i> for the
left and the right one of a pair. In shapes the triangle is the tow point, the disk the fish (or the end of a cable
without one), a circle a node, and the line of dashes and dots the axis of rotation.</p>
$figures
<h2 id="photographs">The photographs</h2>
<p>Figs. 3 to 5 of the report show cables in air, with the drag constant <i>C</i> = $drag. For eight photographs it
states the number of nodes. Beside it stand that of the median root in a vacuum, and with the drag of the experiment
that of the equilibrium whose fish is nearest to the axis.</p>
<table class="narrow">
<thead><tr><th scope="col">Fig.</th><th scope="col" class="n">&lambda;</th>
<th scope="col" class="n"><i>w</i><sub>f</sub></th><th scope="col" class="n">&gamma;</th>
<th scope="col" class="n">nodes photographed</th>$models</tr></thead>
<tbody>
$photographs</tbody></table>
<p>$failures</p>
<p>The weights of the fish and the drag constant are recomputed <a href="#numbers">above</a>. The lengths of the cables
are not printed; with the tow radius of 11/16 in the values of &lambda; give $lengths.</p>
$lasting"""

# $ marks what `towatlas.report.nrl7048.lasting_page` fills in.
LASTING = """
<h2 id="lasting">Which shapes last</h2>
<p>The report calls a stability analysis noteworthy as missing. Here it is: its Eqs. (12) and (15b) with time,
linearised about a shape in the turning frame. A small motion grows as exp(growth <i>t</i>) and turns by frequency
<i>t</i>, with <i>t</i> in &radic;(<i>R</i>/<i>g</i>); shown is the leading eigenvalue, a zero of the Evans function,
and all that grow are counted. In air, <i>C</i> = $drag, it is that of the shape next to the axis, in a vacuum that of
the median root. <i>Turns to e</i> are turns of the tow point in which a motion grows by a factor of e; <i>weak</i> is
growth below 0.01 &gamma;.</p>
$growth
<p>$stable last. $unstable grow, and were photographed: $several of eight lie within windows of speed in which the
shape next to the axis does not last. Inside or outside is decided by where the edge of a window is.</p>
$figure
<h3>Fig. 6</h3>
<p>$fig6</p>
<h3>The edges</h3>
<p>The edge of a window that is nearest to each photograph, how far it is from the speed printed, by how much it moves
with $change % more length, weight of the fish and drag, each computed anew, and the largest growth in that window.
Growth was counted at speeds $spacing % apart at most: narrower windows may be missed.</p>
$edges
<p>That of Fig. 3c, at &gamma; = $edge, comes down to 5.94 with a line longer by $longer %. The centre of the sinker
does hang below the knot: a lead ball of 14.132 g has a radius of $ball <i>R</i>.</p>
<h3>What the model does not explain</h3>
<p>Growth at the speeds of the photographs if the line was longer or the drag another; shaded where it is above
0.01 &gamma;.</p>
$changed
$unexplained

<h2 id="interpretation">The interpretation</h2>
<p>In lieu of that analysis the report reads its solution curves in six steps, and it draws conclusions from experiment
and theory. Here they are tried, in a vacuum where nothing else is said, on five cables and as many of their first three
transitions as they have.</p>
$claims"""

GROWTH_CAPTION = """\
Growth of the shape next to the axis in air, <i>C</i> = $drag, in factors of e in a turn of the tow point; shaded are
windows in which it exceeds 0.01 &gamma; somewhere. Photographs are disks where the shape lasts, crosses where it does
not; the cross at 3.9 is Fig. 6. Triangles: critical speeds of the vacuum, at which the median root changes."""

FIG_6_WORDS = """\
At &gamma; = $gamma the shape next to the axis is in a window of flutter, from $low to $high: it grows by $growth, a
factor of e in $turns turns, with a frequency of $frequency. In air there is no fold: from &gamma; = $slowest to
$fastest the cable has $count shapes at every speed, and the one next to the axis goes over from one node to two by
itself, between &gamma; = $before and $after. In a vacuum the shapes with two nodes come into being at
&gamma;<sub>c2</sub> = $c2, $below % below the speed of the figure, where the median root ($nodes nodes) grows by
$vacuum. What the report takes for a jump from one shape to the next is, by its own equations, a shape that is there
and does not last."""

UNEXPLAINED = """\
<p>$verdict</p>
<ul>
$items</ul>
<p>Fig. 4c (&lambda; = $lam, <i>w</i><sub>f</sub> = $w_f, &gamma; = $gamma) is not explained: with the printed numbers
its shape grows by $growth, with <i>C</i> = $drag it is $less, and with the longer line, which Fig. 3c needs, it grows
by $more. It lies $above % above the edge at $edge; a longer line moves that edge down, and the photograph deeper into
the window.</p>"""
