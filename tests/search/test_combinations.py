"""Choice from a catalog: every combination, exchanges, and the amounts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sweep.base.errors import StudyError
from sweep.base.types import in_turn
from sweep.designs.families.mixture import Mixture
from sweep.metrics.evaluate import designed_quantities
from sweep.metrics.smooth import smooth_csd
from sweep.search.combinations import Choice, choose, with_members
from sweep.search.problem import Problem, starting_points
from sweep.study import load_study

from .problems import YELLOW_RED

STUDY = """\
study: mix
sensor: ar0820
lights: tl16
cfas: [RGGB, RYNCy]
colorants: modeled
boxes:
  mix: {cfa: RYNCy, channel: N, base: Y, family: mixture, options: {at_most: SLOTS}, box: BOX}
constraints: {sensitivity: {min: 0.9}}
search: {starts: 2, max_evaluations: 200}
"""
NUMBERS = 20


def problem(tmp_path: Path, slots: int, numbers: int = NUMBERS) -> Problem:
    ranges = [f"colorant_{i}: [1, {numbers}], absorbance_{i}: [0, 3]" for i in range(1, slots + 1)]
    text = STUDY.replace("SLOTS", str(slots)).replace("BOX", f"{{{', '.join(ranges)}}}")
    (tmp_path / "mix.yaml").write_text(text)
    study = load_study(tmp_path / "mix.yaml")
    assert study.search is not None
    return study.problem(study.search)


def chosen(task: Problem, exhaustive: int) -> Choice:
    return choose(task, "SLSQP", 60, 1, in_turn, lambda *_: None, exhaustive)


@pytest.mark.slow
def test_exchange_finds_the_best_pair_of_all(tmp_path: Path) -> None:
    task = problem(tmp_path, 2, 30)
    exhaustive, exchange = chosen(task, 1_000), chosen(task, 0)
    assert len(exhaustive.tried) == 30 + 435
    assert len(exchange.tried) < 0.6 * len(exhaustive.tried)
    assert exchange.best == exhaustive.best
    largest = exhaustive.tried[exhaustive.best].objective
    assert exchange.tried[exchange.best].objective == pytest.approx(largest, rel=1e-12)


def test_singles_are_those_of_a_fine_grid_of_amounts(tmp_path: Path) -> None:
    """The largest CSD of a colorant over 301 amounts, by the forward model itself."""
    task = problem(tmp_path, 1)
    assert isinstance(task.family, Mixture)
    tried = chosen(task, 0).tried
    assert sorted(tried) == [(number,) for number in range(1, NUMBERS + 1)]
    for number in (1, 7, 20):
        alone = with_members(task, (number,))
        amounts = np.linspace(0, 1, 301)[:, None]
        x = np.array([alone.from_unit(u) for u in amounts])
        curves = alone.family.curves(x)
        feasible = designed_quantities(alone.setup, curves)["sensitivity"] >= 0.9
        best = smooth_csd(alone.setup, curves, YELLOW_RED)[feasible].max()
        assert best - 1e-9 <= tried[number,].objective <= best * 1.03
        assert tried[number,].x[0] == number


def test_a_slot_without_a_member_has_no_amount(tmp_path: Path) -> None:
    alone = with_members(problem(tmp_path, 2), (5,))
    assert alone.free.tolist() == [1]
    np.testing.assert_array_equal(alone.from_unit(np.array([0.5])), [5, 1.5, 5, 0, 0.8])
    (start,) = starting_points(alone, 1, 1)
    assert start.shape == (1,)


def test_equal_colorants_and_one_that_absorbs_nothing_are_no_trouble(tmp_path: Path) -> None:
    task = problem(tmp_path, 2)
    assert isinstance(task.family, Mixture)
    spectra = task.family._spectra.copy()
    spectra[1], spectra[2] = spectra[0], 0.0
    wave, base = task.family._wavelength_nm, task.family._base
    family = Mixture(wave, base, spectra[:4], 2)
    choice = chosen(replace(task, family=family, high=np.array([4, 3, 4, 3, 0.8])), 100)
    assert len(choice.tried) == 4 + 6
    assert np.isfinite(choice.tried[choice.best].objective)


@pytest.mark.parametrize(
    ("box", "said"),
    [
        ("{colorant_1: [1, 5], absorbance_1: [0, 3], absorbance_2: [0, 3]}", "colorant_2: the range is not that of"),
        ("{colorant_1: [1.5, 5], colorant_2: [1.5, 5]}", "colorant_1: colorants have whole numbers"),
        ("{colorant_1: [0, 5], colorant_2: [0, 5]}", "colorant_1: out of range .* allowed: 1 to 45"),
    ],
)
def test_an_unsuitable_range_of_colorants_is_refused(tmp_path: Path, box: str, said: str) -> None:
    (tmp_path / "mix.yaml").write_text(STUDY.replace("SLOTS", "2").replace("BOX", box))
    with pytest.raises(StudyError, match=said):
        load_study(tmp_path / "mix.yaml")
