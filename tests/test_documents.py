"""The documentation: tables as the program prints them, figures that a run reproduces."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from sweep.base.types import in_turn
from sweep.runs.rows import rules_of
from sweep.runs.search import run_search
from sweep.study import load_study

from .commanded import commanded
from .conftest import FEWER, ROOT, STUDIES, FinishedFolder, draw_nothing
from .gallery import ANSWERED, GALLERY, PICTURES, plain, report_in, with_answer, with_run, with_table
from .printed import PRINTED, with_printed

README = (ROOT / "README.md").read_text()


@pytest.mark.parametrize("file", list(PRINTED))
def test_printed_parts_are_as_the_program_prints_them(file: str) -> None:
    text = (ROOT / file).read_text()
    assert with_printed(text, PRINTED[file]) == text


WHOLE = ("fog", "noise", "exposure")
"""Studies that are run with all of their scenarios here."""


@pytest.mark.gallery
@pytest.mark.parametrize(
    "name", [name for name in PICTURES if name in WHOLE or name not in {"vision", "sensors", *FEWER}]
)
def test_an_answer_in_the_documents_is_that_of_its_run(
    finished: FinishedFolder, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if name in WHOLE:
        draw_nothing(monkeypatch)
        assert commanded("run", STUDIES / f"{name}.yaml", "--output", tmp_path, "--jobs", 1)[0] == 0
        folder = tmp_path / name
    else:
        folder = finished(name)
    report = report_in(folder)
    answer = plain(report.sentence)
    shown = GALLERY.read_text()
    assert _comparable(with_table(shown, name, report.markdown), name) == _comparable(shown, name)
    for document in ANSWERED:
        text = document.read_text()
        assert _comparable(with_answer(text, name, answer), name) == _comparable(text, name), document


def _comparable(text: str, study: str) -> str:
    """A document; of all tiles without a right edge beyond the wavelengths, where it may lie anywhere."""
    return re.sub(r" and 7\d\d nm", " and beyond", text) if study == "tiles" else text


def test_the_readme_has_the_answer_of_its_run(finished: FinishedFolder) -> None:
    assert with_run(README, finished("stopband")) == README
    words = re.sub(r"<!--.*?-->|```.*?```|^\|[^\n]*\|$", "", README, flags=re.DOTALL | re.MULTILINE).split()
    assert len(words) <= 600
    assert README.count("](studies/figures/") == 2


def test_the_figure_of_measured_films_is_that_of_a_search(tmp_path: Path) -> None:
    (tmp_path / "films.yaml").write_text(
        (STUDIES / "band.yaml").read_text().split("tasks:")[0].replace("catalog: modeled", "catalog: films")
        + "boxes: {films: {cfa: RYNCy, channel: N, base: Y, family: mixture, options: {at_most: 1}, box: {absorbance_1: [0, 6]}}}\n"
        "constraints: {sensitivity: {min: 0.9}}\nsearch: {starts: 1}\n"
    )
    loaded = load_study(tmp_path / "films.yaml")
    assert loaded.search is not None
    answer = run_search(loaded, loaded.search, rules_of(loaded), in_turn, lambda *_: None)
    assert answer.choice is not None
    assert answer.best.objective >= answer.choice.tried[answer.choice.best].objective * (1 - 1e-9)
    said = f"The best single one has {answer.best.objective:.1f}, "
    assert said in " ".join((STUDIES / "guide" / "10-colorants.md").read_text().split())
