"""YAML as a study reads it: as the library does, with lines, and up to limits; else one line each, or quick."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from sweep.base.errors import MOST_ISSUES, StudyError, ValidationIssue, nearest
from sweep.study import load_study
from sweep.study.document import Document

from ..watchdog import within

SMALL = "study: a\nsensor: ar0820\nlights: tl16\ncfas: [RGGB]\n"
HANG_S = 120.0


def bomb() -> str:
    """Nine lists of nine aliases each: 700 bytes for a billion values."""
    lists = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lists += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 9)]
    return SMALL + "\n".join(lists) + "\n"


def merged_bomb() -> str:
    """Mappings that merge each other twice."""
    maps = ["m0: &m0 {a: 1, b: 2}", *(f"m{i}: &m{i} {{<<: [*m{i - 1}, *m{i - 1}], x: 1}}" for i in range(1, 40))]
    return SMALL + "\n".join(maps) + "\n"


TOO_MUCH: dict[str, tuple[Callable[[], str | bytes], str]] = {
    "aliases of aliases": (bomb, "a4: more keys and values than a study has; allowed: at most 50,000"),
    "merges of merges": (merged_bomb, "nested too deep"),
    "a list in itself": (lambda: SMALL + "x: &x [1, *x]", "5: x: nested too deep"),
    "an alias of nothing": (lambda: SMALL + "x: *y\n", "5: not valid YAML"),
    "a Python object": (lambda: SMALL + "question: !!python/object/apply:os.getcwd []\n", "5: question: a tag"),
    "a long number": (lambda: SMALL + f"seed: {'9' * 60_000}\n", "5: seed: a number of 60,000 letters"),
    "a long fraction": (lambda: SMALL + f"tolerance_dn: 0.{'1' * 5000}\n", "5: tolerance_dn: a number of 5,002"),
    "brackets": (lambda: SMALL + "x: " + "[" * 5000 + "]" * 5000, "nested too deep"),
    "indents": (lambda: "\n".join(" " * i + f"k{i}:" for i in range(800)), "nested too deep"),
    "a long comment": (lambda: SMALL + "#" + "x" * 10_000_000, "the file is too large"),
    "many unknown keys": (lambda: SMALL + "".join(f"k{i}: 1\n" for i in range(2_000)), "k0: unknown key"),
    "two documents": (lambda: SMALL + "---\nstudy: b\n", "5: not valid YAML"),
    "YAML 1.1": (lambda: "%YAML 1.1\n---\n" + SMALL, "another version of YAML"),
    "a key that is a list": (lambda: SMALL + "[1, 2]: 3\n", "5: a key that is no word"),
    "UTF-16": (lambda: SMALL.encode("utf-16"), "UTF-16?"),
    "UTF-16 without its mark": (lambda: SMALL.encode("utf-16-le"), "1: NUL characters in the text"),
    "Latin-1": (lambda: SMALL.encode() + b"question: caf\xe9\n", "5: not UTF-8 text"),
    "a bell": (lambda: SMALL + "question: \x07\n", "5: not valid YAML: the character"),
    "half a character": (lambda: SMALL + 'question: "\\ud800"\n', "question: not a character of a text"),
    "an endless quote": (lambda: SMALL + 'question: "' + "x y\n" * 100_000, "5: not valid YAML"),
    "a key of a megabyte": (lambda: SMALL + "? " + "x" * 400_000 + "\n: 1\n", "unknown key"),
    "nothing": (lambda: "", "1: a study file is a mapping of keys"),
}


def refused(path: Path) -> list[str]:
    with pytest.raises(StudyError) as caught, within(HANG_S):
        load_study(path)
    return [str(issue).replace(str(path), "FILE") for issue in caught.value.issues]


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.slow if name == "an endless quote" else ()) for name in TOO_MUCH],
)
def test_too_much_is_one_line(tmp_path: Path, name: str) -> None:
    made, expected = TOO_MUCH[name]
    text = made()
    path = tmp_path / "a.yaml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    found = refused(path)
    assert found[0].startswith("FILE:"), found
    assert expected in found[0], found
    assert len(found) <= MOST_ISSUES
    assert all(len(line) < 10_000 and line.isprintable() for line in found)


def test_names_steer_no_terminal_and_are_cut() -> None:
    line = str(ValidationIssue("unknown\x1b[2J", "a\ud800.yaml", 3, "k" * 10**6, "v" * 10**6, "a, " * 10**6))
    assert line.isprintable()
    assert len(line) < 10_000
    assert nearest("x" * 10**6, ["x" * 10**6]) is None


def test_valid_yaml_is_read_as_by_the_library(tmp_path: Path) -> None:
    text = (
        "%YAML 1.2\n---\nbase: &base {a: 1, b: [x, 'y', \"z\\n\"]}\n"
        "more: {<<: *base, a: 2}\nmost: {<<: [{c: 3}, *base], d: *base}\n"
        "numbers: [0, -0, +7, 0x1F, 0o17, 010, 1.5, -2e-3, .5, 6., 1E5, .inf, -.INF]\n"
        "others: [~, null, true, False, yes, 1_000, 2026-01-01, 1:30, ., e5, '1']\n'1': one\n2: two\ntrue: three\n"
        "folded: >-\n  a\n  b\nliteral: |\n  a\n\n  b\nplain: a\n  b # no\nempty:\n"
    )
    path = tmp_path / "a.yaml"
    path.write_text(text)
    data = Document(path).data
    expected = YAML(typ="safe", pure=True).load(text.replace("1_000", "'1_000'").replace("2026-01-01", "'2026-01-01'"))
    assert data == {("true" if key is True else str(key)): value for key, value in expected.items()}
    assert str(data["numbers"][1]) == "0"
    path.write_text("a: -0.0\n")
    assert str(Document(path).data["a"]) == "0.0"


def test_lines_are_those_of_keys_and_entries(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(
        "# note\na:\n  b: [1,\n     2]\n  c:\n    - x: 1\n    - {y: 2,\n       z: 3}\nd: &d {e: 1}\nf: *d\ng:\n  <<: *d\n"
    )
    document = Document(path)
    lines = {
        ("a",): 2,
        ("a", "b", 0): 3,
        ("a", "b", 1): 4,
        ("a", "c", 0, "x"): 6,
        ("a", "c", 1): 7,
        ("a", "c", 1, "z"): 8,
        ("f",): 10,
        ("f", "e"): 9,
        ("g", "e"): 11,
        ("g", "absent"): 11,
        ("absent",): 1,
    }
    assert {key: document.place(key) for key in lines} == lines


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_only_files_are_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.yaml")
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "folder.yaml").mkdir()
    for path in (tmp_path / "pipe.yaml", Path("/dev/zero"), tmp_path / "folder.yaml"):
        assert "not a file" in refused(path)[0]
    for path in (tmp_path / "absent.yaml", tmp_path / ("n" * 300), tmp_path / "a\0b", Path("/proc/self/mem")):
        assert "cannot be read" in refused(path)[0]
    study = tmp_path / "a.yaml"
    for name in ("pipe.csv", "n/" * 2000 + "x.csv", '"a\\tb.csv"'):
        study.write_text(SMALL.replace("sensor: ar0820", f"sensor: {{files: [{{file: {name}, columns: {{R: R}}}}]}}"))
        assert "2: sensor.files[0].file: no such file" in refused(study)[0]


def test_a_data_folder_that_cannot_be_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(SMALL)
    for name in ("n" * 300, "absent", "a\0b"):
        with pytest.raises(StudyError, match="no such folder"):
            load_study(tmp_path / "a.yaml", tmp_path / name)
