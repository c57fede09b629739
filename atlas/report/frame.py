"""What the pages of all sources share: their frame, figures as elements of a page, tables, symbols and numbers."""

import html
import io
import re
from collections.abc import Callable, Iterable
from string import Template
from typing import Any

import matplotlib
from matplotlib.figure import Figure

PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
body { max-width: 54rem; margin: 2rem auto; padding: 0 1rem; background: #fff; color: #111;
  font: 1rem/1.5 Georgia, "Times New Roman", serif; }
h1, h2, h3, th, nav { font-family: "Helvetica Neue", Arial, sans-serif; line-height: 1.25; }
h1 { font-size: 1.7rem; } h2 { font-size: 1.3rem; margin-top: 2.5rem; } h3 { font-size: 1.05rem; margin-top: 2.5rem; }
a { color: #0050a0; }
figure { margin: 0; break-inside: avoid; }
figure svg { display: block; margin: 0 auto; max-width: 100%; height: auto; }
figcaption { margin: .5rem 0 1rem; }
table { border-collapse: collapse; width: 100%; font-size: .85rem; line-height: 1.35; }
.wide { overflow-x: auto; }
th, td { padding: .3rem .4rem; border-bottom: 1px solid #ccc; text-align: left; vertical-align: top; }
thead th { border-bottom: 2px solid #111; }
.numbers td:nth-child(2) { min-width: 9rem; }
.numbers td:last-child { min-width: 10rem; }
.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
tr { break-inside: avoid; }
tr.differs td, td.wrong { background: #fdeee0; }
td.wrong { font-weight: bold; }
.narrow { width: auto; margin: 0 auto; }
small { color: #333; white-space: normal; }
sub, sup { line-height: 0; }
@media print {
  @page { margin: 16mm; }
  body { max-width: none; margin: 0; padding: 0; font-size: 10pt; }
  .wide { overflow: visible; }
  h2, h3 { break-after: avoid; }
  thead { display: table-header-group; }
  table { font-size: 8pt; }
  a { color: inherit; text-decoration: none; }
}
</style>
</head>
<body>
<h1>$title</h1>
$body
</body>
</html>
""")


def page(title: str, body: str) -> str:
    """A page that needs no other file.

    Parameters
    ----------
    title : str
        Plain text.
    body : str
        HTML below the title.

    Returns
    -------
    str
    """
    return PAGE.substitute(title=html.escape(title), body=body)


def svg(name: str, title: str, size: tuple[float, float], draw: Callable[[Figure], object]) -> str:
    """A figure as an element of a page, with ids that no other figure has.

    Parameters
    ----------
    name : str
        What its ids begin with.
    title : str
        For who cannot see it.
    size : tuple of two float
        Width and height [in].
    draw : callable
        Draws on the Figure that it is given.

    Returns
    -------
    str
    """
    style: Any = {"svg.hashsalt": "towatlas", "svg.fonttype": "path", "font.size": 10.0}
    with matplotlib.rc_context(style):
        drawing = Figure(figsize=size, layout="constrained")
        draw(drawing)
        buffer = io.StringIO()
        drawing.savefig(buffer, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    text = buffer.getvalue()
    text = re.sub(r"<!--.*?-->\n?", "", text[text.index("<svg") :], flags=re.S).strip()
    text = re.sub(r'(\bid="|href="#|url\(#)', rf"\1{name}-", text)
    return text.replace("<svg", f'<svg role="img" aria-label="{html.escape(title)}"', 1)


def figure(name: str, title: str, drawing: str, caption: str, below: str = "") -> str:
    """A section with a figure.

    Parameters
    ----------
    name, title : str
        Its id and its heading.
    drawing : str
        From `svg`.
    caption, below : str
        HTML within and below the figure.

    Returns
    -------
    str
    """
    return (
        f'<section id="{name}">\n<h3>{title}</h3>\n<figure>\n{drawing}\n<figcaption>{caption}</figcaption>\n</figure>\n'
        f"{below}</section>\n"
    )


def table(head: Iterable[str], rows: Iterable[Iterable[str]], kind: str = "", text: Iterable[int] = (0,)) -> str:
    """A table; cells are HTML, numbers stand at the right.

    Parameters
    ----------
    head : iterable of str
        Of the columns.
    rows : iterable of iterable of str
        One that begins with <td is a cell with an attribute of its own.
    kind : str
        Class of the table.
    text : iterable of int
        Columns that hold text.

    Returns
    -------
    str
    """
    left = set(text)
    classes = ["" if k in left else ' class="n"' for k in range(100)]
    heads = "".join(f'<th scope="col"{which}>{cell}</th>' for cell, which in zip(head, classes, strict=False))
    lines = []
    for row in rows:
        cells = zip(row, classes, strict=False)
        lines.append("".join(cell if cell.startswith("<td") else f"<td{which}>{cell}</td>" for cell, which in cells))
    body = "".join(f"<tr>{line}</tr>\n" for line in lines)
    return (
        f'<div class="wide"><table{f" class={kind!r}" if kind else ""}>\n<thead><tr>{heads}</tr></thead>\n'
        f"<tbody>\n{body}</tbody></table></div>\n"
    )


_SYMBOL = re.compile(r"\b(lambda|gamma)(?:_(c\d?))?\b|\b([Rwxz])_(x0|f)\b|\b(E)\b")


def maths(text: str) -> str:
    """Plain text as HTML, its symbols set as such, equations not broken.

    Parameters
    ----------
    text : str

    Returns
    -------
    str

    Examples
    --------
    >>> maths("gamma_c2 = -1")
    '&gamma;<sub>c2</sub>&nbsp;=&nbsp;&minus;1'
    """

    def symbol(match: re.Match[str]) -> str:
        greek, letter, error = match[1], match[3], match[5]
        name = {"lambda": "&lambda;", "gamma": "&gamma;"}[greek] if greek else f"<i>{letter or error}</i>"
        below = match[2] or match[4]
        return name + (f"<sub>{below}</sub>" if below else "")

    text = _SYMBOL.sub(symbol, re.sub(r"(?<![\w.])-(?=\d)", "&minus;", html.escape(text, quote=False)))
    return text.replace(" = ", "&nbsp;=&nbsp;")


def number(value: float | str, form: str = "") -> str:
    """A number with a true minus, infinity as a sign and powers of ten as such.

    Parameters
    ----------
    value : float or str
        A text is one that has been formatted.
    form : str
        Format of a float.

    Returns
    -------
    str

    Examples
    --------
    >>> number(-1.5e-7, ".2g")
    '&minus;1.5&middot;10<sup>&minus;7</sup>'
    """
    text = value if isinstance(value, str) else format(value, form)
    text = re.sub(r"e([+-])0*(\d+)", lambda m: f"&middot;10<sup>{m[1].strip('+')}{m[2]}</sup>", html.escape(text))
    return text.replace("-", "&minus;").replace("inf", "&infin;")
