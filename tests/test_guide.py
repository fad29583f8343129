"""The guide: every file, study fragment, command and Python example of its pages runs and prints what the page shows."""

from __future__ import annotations

import doctest
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from ruamel.yaml import YAML

from sweep.study import load_study

from .commanded import commanded
from .conftest import STUDIES

GUIDE = STUDIES / "guide"
PAGES = sorted(path.name for path in GUIDE.glob("[0-9]*.md"))
SLOW = "slow"
"""After the language of a block: it takes more than a few seconds."""


class Block(NamedTuple):
    """A fenced block: its language, the word after it (a file name, a study or `slow`), and its text."""

    language: str
    word: str
    text: str


def blocks(page: str) -> list[Block]:
    fences = re.findall(r"^```(\w*) ?(\S*)\n(.*?)^```$", (GUIDE / page).read_text(), re.MULTILINE | re.DOTALL)
    return [Block(*fence) for fence in fences]


def commands(text: str) -> Iterator[tuple[list[str], str]]:
    """Arguments and expected output of each command of a console block."""
    for command in re.split(r"^\$ sweep ", text, flags=re.MULTILINE)[1:]:
        line, _, expected = command.partition("\n")
        yield shlex.split(line), expected.strip()


def pattern(expected: str) -> str:
    """A regular expression in which `...` stands for any text."""
    return ".*".join(re.escape(part.strip()) for part in expected.split("..."))


def run_command(arguments: list[str], expected: str) -> None:
    code, out, err = commanded(*arguments)
    output = re.sub(r"^.* left\b.*\n?", "", err, flags=re.MULTILINE) + out
    if code:
        output += f"[exit code {code}]"
    assert re.fullmatch(pattern(expected), output.strip(), re.DOTALL), output


def load_fragment(study: str, text: str, folder: Path) -> None:
    """Load a study of the project in which the keys of a fragment replace those of the file; a null removes a key."""
    yaml = YAML()
    document: dict[str, Any] = yaml.load(STUDIES / f"{study}.yaml")
    document |= yaml.load(text)
    path = folder / "fragment.yaml"
    yaml.dump({key: value for key, value in document.items() if value is not None}, path)
    load_study(path, allow_code=True)


def run_page(page: str, folder: Path, *, slow: bool) -> None:
    names: dict[str, Any] = {}
    for block in blocks(page):
        if block.word == SLOW and not slow:
            continue
        if "." in block.word:
            (folder / block.word).write_text(block.text)
        elif block.language == "yaml":
            load_fragment(block.word, block.text, folder)
        elif block.language == "console":
            for arguments, expected in commands(block.text):
                run_command(arguments, expected)
        else:
            assert block.language == "python", block
            examples = doctest.DocTestParser().get_doctest(block.text, names, page, page, 0)
            runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
            assert runner.run(examples, clear_globs=False).failed == 0
            names = examples.globs


@pytest.mark.parametrize("page", PAGES)
def test_page_runs_as_shown(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run_page(page, tmp_path, slow=False)


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=pytest.mark.gallery if page.startswith("10") else pytest.mark.slow)
        for page in PAGES
        if any(block.word == SLOW for block in blocks(page))
    ],
)
def test_page_with_long_runs_runs_as_shown(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run_page(page, tmp_path, slow=True)
