"""What pyproject.toml cannot say: the description of the package, as a package index shows it."""

import re
from pathlib import Path

from setuptools import setup


def description() -> str:
    """The README; files of the repository are named where it links to them: elsewhere such links lead nowhere."""
    text = Path(__file__).with_name("README.md").read_text(encoding="utf-8")
    text = re.sub(r"!\[([^]]*)\]\((?!https?:)([^)]*)\)", r"*\1*: `\2` of the sources", text)
    return re.sub(r"\[([^]]*)\]\((?!https?:)([^)#]*)(#[^)]*)?\)", _named, text)


def _named(link: re.Match[str]) -> str:
    words, file = link[1], link[2]
    return f"`{file}`" if words == file else f"{words} (`{file}`)"


setup(long_description=description(), long_description_content_type="text/markdown")
