"""Sphinx, by `make docs`. Nothing is fetched while the site is built or read."""

from docutils import nodes
from sphinx.application import Sphinx

import towatlas

project = "towatlas"
author = "The towatlas developers"
project_copyright = "the towatlas developers, MIT license"
version = release = towatlas.__version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "numpydoc"]
exclude_patterns = ["data"]
highlight_language = "none"
# In docstrings `x_f` is code.
default_role = "code"
myst_heading_anchors = 4
# The notebooks hold their answers, which the tests compare.
nb_execution_mode = "off"
autodoc_typehints = "none"
numpydoc_show_class_members = False

html_theme = "furo"
html_title = f"towatlas {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False

# Fenced as python, sh, octave or r a block is run by tests/test_docs.py, in other ways it is not.
NOT_RUN = {"py", "matlab", "julia"}
PROGRAMS = {"towatlas", "make", "pip", "python", "eval"}


def mark_what_is_not_run(app: Sphinx, doctree: nodes.document) -> None:
    """Put the words "not run" above each block of commands that no test runs."""
    for block in list(doctree.findall(nodes.literal_block)):
        language, words = block.get("language", "none"), block.astext().split(maxsplit=1)
        if language in NOT_RUN or (language in ("none", "default") and words and words[0] in PROGRAMS):
            block.parent.insert(block.parent.index(block), nodes.paragraph("", "not run", classes=["not-run"]))


def setup(app: Sphinx) -> None:
    app.connect("doctree-read", mark_what_is_not_run)
