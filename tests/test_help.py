"""What the help of the commands says, and what a shell completes."""

import re
import shlex
import subprocess
import sys

import pytest
from helpers import run

from towatlas.cli import COMMANDS, _parser
from towatlas.commands.examples import EXAMPLES
from towatlas.scene.file import shipped_scenes

LINES = [(name, line) for name in COMMANDS for line in EXAMPLES.get(name, ())]


def test_every_command_has_examples():
    assert set(EXAMPLES) == set(COMMANDS)
    assert all(EXAMPLES.values())


@pytest.mark.parametrize(("name", "line"), LINES)
def test_examples_parse(name, line):
    """Each is of the command whose help it ends; a scene that is no file comes with the package."""
    program, *words = shlex.split(line, comments=True)
    assert (program, words[0]) == ("towatlas", name)
    options = _parser([name]).parse_args(words)
    scene = getattr(options, "scene", None) or (options.file if name == "scene" else None)
    assert scene is None or scene == "search.toml" or scene in shipped_scenes()


@pytest.mark.parametrize("name", ["", *COMMANDS])
def test_help_speaks_of_no_file_of_the_repository(capsys, name):
    """Whoever has installed a wheel has none; examples stand whole, a line each."""
    code, out, _ = run(capsys, *([name] if name else []), "--help")
    assert code == 0
    # "its folder build" of a clone is said to be one.
    assert not re.search(r"\b(docs|build|atlas|kernels|tests)/|\.md\b|make \w+", out)
    for line in EXAMPLES.get(name, ()):
        assert f"\n  {line}\n" in out
        assert len(line) <= 110


COMPLETE = """
. "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMPREPLY=()
complete=$(complete -p towatlas)
[[ $complete =~ -F\\ ([^ ]+) ]]
"${BASH_REMATCH[1]}" towatlas "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD - 1]}"
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["cri"], {"critical"}),
        (["critical", "--so"], {"--solve"}),
        (["report", "dt"], {"dtmb713"}),
        (["shape", "sce"], {"scene.toml"}),
    ],
)
def test_bash_completes(capsys, tmp_path, words, expected):
    """Commands, options, choices and names of files."""
    pytest.importorskip("shtab")
    code, script, err = run(capsys, "--print-completion", "bash")
    assert (code, err) == (0, "")
    (tmp_path / "completion").write_text(script)
    (tmp_path / "scene.toml").touch()
    command = ["bash", "-c", COMPLETE, "bash", "completion", "towatlas", *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert set(done.stdout.split()) == expected


def test_completion_without_its_extra(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "shtab", None)
    code, out, err = run(capsys, "--print-completion", "zsh")
    assert (code, out) == (2, "")
    assert "pip install 'towatlas[completion]'" in err
