"""The documentation: tables as the program prints them, figures that a run reproduces."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from sweep.base.types import in_turn
from sweep.report.price import price_table
from sweep.results.output import read_output
from sweep.runs.search import run_search
from sweep.study import load_study

from .commanded import commanded
from .conftest import FEWER, ROOT, STUDIES, FinishedFolder, draw_nothing
from .gallery import ANSWERED, PICTURES, answer_of, with_answer
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
        code, output, _ = commanded("run", STUDIES / f"{name}.yaml", "--output", tmp_path, "--jobs", 1)
        assert code == 0
    else:
        output = finished(name).with_name(f"{name}.said.txt").read_text()
    for document in ANSWERED:
        text = document.read_text()
        assert with_answer(text, name, answer_of(output)) == text, document


def stopband(finished: FinishedFolder) -> dict[str, pd.Series]:
    """Rows of the finished study by their names."""
    table = pd.read_parquet(finished("stopband") / "results.parquet")
    return {row["name"]: row for _, row in table[table["kind"] != "sweep"].iterrows()}


FIGURES: dict[str, Callable[[dict[str, pd.Series]], str]] = {
    "234 DN at 0.591": lambda r: (
        f"{r['best stopband']['csd_yellow_red']:.0f} DN at {r['best stopband']['cfa_sensitivity']:.3f}"
    ),
    "1.68 times the separation of RGGB (139 DN)": lambda r: (
        f"{r['best stopband']['csd_yellow_red'] / r['RGGB']['csd_yellow_red']:.2f} times the separation of RGGB "
        f"({r['RGGB']['csd_yellow_red']:.0f} DN)"
    ),
    "1.68 times its light (0.352)": lambda r: (
        f"{r['best stopband']['cfa_sensitivity'] / r['RGGB']['cfa_sensitivity']:.2f} times its light "
        f"({r['RGGB']['cfa_sensitivity']:.3f})"
    ),
    "31 DN at 0.610": lambda r: f"{r['RYYCy']['csd_yellow_red']:.0f} DN at {r['RYYCy']['cfa_sensitivity']:.3f}",
    "90 % of its sensitivity": lambda r: f"{100 * r['best stopband']['sensitivity']:.0f} % of its sensitivity",
    "at most 0.06 per nm": lambda r: f"at most {r['best stopband']['slope_per_nm']:.2f} per nm",
    "is 274.3 DN before quantization": (
        lambda r: f"is {math.ceil(10 * r['best stopband']['limit']) / 10} DN before quantization"
    ),
}
"""Figures of the README -> the same from a run of `make study NAME=stopband`."""


def test_the_price_in_the_readme_is_that_of_a_run(finished: FinishedFolder) -> None:
    table = price_table(read_output(finished("stopband")))
    printed = [f"| {' | '.join(row)} |" for row in table.astype(str).to_numpy().tolist()]
    assert [line for line in README.splitlines() if line.endswith(("| gain |", "| loss |"))] == printed


@pytest.mark.parametrize("said", list(FIGURES))
def test_a_figure_of_the_readme_is_that_of_its_command(finished: FinishedFolder, said: str) -> None:
    assert FIGURES[said](stopband(finished)) == said


def test_the_figure_of_measured_films_is_that_of_a_search(tmp_path: Path) -> None:
    (tmp_path / "films.yaml").write_text(
        (STUDIES / "band.yaml").read_text().split("tasks:")[0].replace("catalog: modeled", "catalog: films")
        + "boxes: {films: {cfa: RYNCy, channel: N, base: Y, family: mixture, options: {at_most: 1}, box: {absorbance_1: [0, 6]}}}\n"
        "constraints: {sensitivity: {min: 0.9}}\nsearch: {starts: 1}\n"
    )
    loaded = load_study(tmp_path / "films.yaml")
    assert loaded.search is not None
    answer = run_search(loaded, loaded.search, in_turn, lambda *_: None)
    assert answer.choice is not None
    assert answer.best.objective >= answer.choice.tried[answer.choice.best].objective * (1 - 1e-9)
    said = f"The best single one has {answer.best.objective:.1f}, "
    assert said in " ".join((STUDIES / "guide" / "10-colorants.md").read_text().split())
