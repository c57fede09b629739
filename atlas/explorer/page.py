"""The page: its parts put together, with the tables of scenes in it."""

import json
import re
from collections.abc import Sequence
from html import escape
from importlib import resources
from typing import Any

from towatlas import __version__
from towatlas.scene.derived import FLUIDS
from towatlas.scene.keys import KEYS
from towatlas.scene.library import find_type, shipped_types

# In the order in which they need each other.
SCRIPTS = (
    "vacuum.js",
    "members.js",
    "motion.js",
    "scene.js",
    "draw.js",
    "state.js",
    "words.js",
    "figures.js",
    "page.js",
)


def explorer_page(tables: Sequence[dict[str, Any]]) -> str:
    """The page that explores scenes, one file that needs no other.

    Parameters
    ----------
    tables : sequence of dict
        From `towatlas.explorer.tables.table_of`, one at least; the first is on show.

    Returns
    -------
    str
        HTML.
    """
    parts = {
        "css": _part("page.css"),
        "js": "\n".join(_part(name) for name in SCRIPTS) + "begin();",
        "known": json_in_html(
            {
                "tables": list(tables),
                "keys": KEYS,
                "fluids": FLUIDS,
                "cables": {name: find_type(name).values for name in shipped_types()},
            }
        ),
        "version": escape(__version__),
    }
    return re.sub(r"@(css|js|known|version)@", lambda found: parts[found[1]], _part("page.html"))


def json_in_html(value: Any) -> str:
    """JSON that cannot end the element of a page that it stands in.

    Parameters
    ----------
    value : object
        Numbers are finite.

    Returns
    -------
    str

    Examples
    --------
    >>> json_in_html({"title": "</script>"})
    '{"title":"\\\\u003c/script>"}'
    """
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace("&", "\\u0026")


def _part(name: str) -> str:
    return (resources.files("towatlas.explorer") / name).read_text(encoding="utf-8")
