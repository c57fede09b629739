"""What a source says in words, each with what holds."""

from collections.abc import Iterable
from dataclasses import dataclass

from towatlas.report.frame import table

HOLDS, PART, FAILS = "holds", "holds in part", "does not hold"


@dataclass(frozen=True)
class Claim:
    """A statement of a source.

    Attributes
    ----------
    place : str
        Where it stands.
    statement : str
        In other words, HTML.
    verdict : str
        HOLDS, PART or FAILS.
    found : str
        What was computed, HTML.
    """

    place: str
    statement: str
    verdict: str
    found: str


def judged(cases: Iterable[bool]) -> str:
    """The verdict on a statement about several cases.

    Parameters
    ----------
    cases : iterable of bool
        Whether it holds in each.

    Returns
    -------
    str

    Examples
    --------
    >>> judged([True, False])
    'holds in part'
    """
    kept = list(cases)
    return HOLDS if all(kept) else PART if any(kept) else FAILS


def claims_table(claims: Iterable[Claim]) -> str:
    """A table of statements; those that do not hold are shaded.

    Parameters
    ----------
    claims : iterable of Claim

    Returns
    -------
    str
    """
    rows = []
    for claim in claims:
        shade = "<td>" if claim.verdict == HOLDS else '<td class="wrong">'
        rows.append((claim.place, claim.statement, f"{shade}{claim.verdict}</td>", claim.found))
    return table(("Place", "It says", "Verdict", "Found"), rows, "claims", text=range(4))
