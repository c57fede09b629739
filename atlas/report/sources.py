"""Which sources are reproduced, and their pages written to files."""

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path


@dataclass(frozen=True)
class Source:
    """A document that a page reproduces.

    Attributes
    ----------
    title : str
        What it is called.
    module : str
        Where its page is made, by a function `report_page` without arguments.
    file : str
        Name of the page.
    """

    title: str
    module: str
    file: str


SOURCES = {
    "nrl7048": Source("NRL Report 7048 (Skop 1970)", "towatlas.report.nrl7048.page", "report.html"),
    "cable-body": Source("a cable and body in water", "towatlas.report.cable_body.page", "cable-body.html"),
    "dtmb713": Source("DTMB Report 713 (Pode 1950)", "towatlas.report.dtmb713.page", "dtmb713.html"),
    "device": Source("a lateral force device (Ng, Rand, Keith 2001)", "towatlas.report.device.page", "device.html"),
}


def write_report(path: str | Path, source: str = "nrl7048") -> Path:
    """Write the page of a source to a file; the same bytes every time on one machine.

    Parameters
    ----------
    path : str or Path
        Where to; its directory is made if need be.
    source : str
        One of SOURCES.

    Returns
    -------
    Path
        The same.
    """
    path = Path(path)
    page: str = import_module(SOURCES[source].module).report_page()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page, encoding="utf-8")
    return path
