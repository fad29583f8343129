"""An upper bound stands beside the designs that it bounds, and beside no others."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from sweep.base.errors import UpperBoundExceededError
from sweep.report.leaders import leaders_of, upper_bound_beside
from sweep.report.sections.scenes import Scenes
from sweep.report.sections.trade_off import TradeOff
from sweep.results.output import Output

from ..build import output_of, sentences_of

SHOWN = re.compile(
    r"No filter in this pixel that stays below \w+ exceeds (?P<value>[\d.]+) DN under the same constraints \(proven"
)
CFAS = {
    "RYNCy": ("RYNCy: {}", "Y"),
    "RCCN": ("RCCN: {tile: [[R, C], [C, N]]}", "C"),
    "RGBN": ("RGBN: {tile: [[R, G], [B, N]]}", "Y"),
}


def study_text(exposures: dict[str, float], grids: dict[str, str], searched: str, scenario: str, least: float) -> str:
    """Return a study of fixed exposures (s), with a sweep in each CFA and a search in one of them and one scenario."""
    scenes = "\n".join(f"  {name}: {{exposure: {{kind: fixed, exposure_s: {s:g}}}}}" for name, s in exposures.items())
    sweeps = "\n".join(
        f"  in_{cfa}: {{cfa: {cfa}, channel: N, base: {CFAS[cfa][1]}, to: G, grid: {grid}}}"
        for cfa, grid in grids.items()
    )
    tiles = ", ".join(["RGGB: {}", *(CFAS[cfa][0] for cfa in grids)])
    return f"""\
study: bounded
sensor: ar0820
lights: tl16
scenarios:
{scenes}
cfas: {{{tiles}}}
sweeps:
{sweeps}
constraints: {{sensitivity: {{min: {least:g}}}}}
search: {{space: in_{searched}, scenario: {scenario}, starts: 2, max_evaluations: 60}}
"""


def check_shown_bounds(output: Output) -> int:
    """Check every upper bound that answer, limits and picture show; return how many the sentences show."""
    search = output.provenance.search
    assert search is not None
    leaders, goal = leaders_of(output), output.goal.name
    table, shown = output.table, 0
    for text in sentences_of(output):
        for match in SHOWN.finditer(text):
            assert leaders.chosen is not None
            assert (leaders.chosen["cfa"], leaders.chosen["scenario"]) == (search.cfa, search.scenario)
            assert leaders.chosen[goal] <= float(match["value"])
            shown += 1
    for trade_off in TradeOff.of(output):
        if trade_off.bounds is None:
            continue
        assert trade_off.cfa == search.cfa
        rounding = math.sqrt(len(output.mosaic(search.cfa).channels))
        rows = table[(table["scenario"] == search.scenario) & (table["cfa"] == search.cfa) & table["feasible"]]
        levels, bounds = trade_off.bounds
        for sensitivity, value in zip(100 * rows["cfa_sensitivity"], rows[goal], strict=True):
            reached = bounds[levels <= sensitivity]
            assert not reached.size or value <= reached[-1] + rounding
    return shown


GRID = "{left_nm: [600, 606, 612], left_width_nm: [6, 30], right_nm: [646, 652], right_width_nm: 7}"


def test_the_bound_of_one_scenario_is_not_shown_beside_the_design_of_another(tmp_path: Path) -> None:
    text = study_text({"day": 2e-4, "night": 5e-3}, {"RYNCy": GRID}, "RYNCy", "day", 0.9)
    output = output_of(tmp_path, text)
    assert check_shown_bounds(output) >= 1
    assert leaders_of(output).scenario == "day"  # the search's
    bright = leaders_of(output, "night").chosen
    assert bright is not None
    assert bright[output.goal.name] > 2 * output.provenance.search.upper_bound_proven  # type: ignore[union-attr, operator]
    (scenes,) = Scenes.of(output)
    best = {scene.partition(":")[0]: design for scene, design, *_ in scenes.rows}
    assert best["night"] == f"filter {bright['filter_id']} of RYNCy"
    assert upper_bound_beside(output, bright) is None


def test_a_value_above_its_own_bound_is_an_error(tmp_path: Path) -> None:
    text = study_text({"chart": 2e-3}, {"RYNCy": GRID}, "RYNCy", "chart", 0.9)
    output = output_of(tmp_path, text)
    row = output.best.iloc[0].to_dict()
    assert output.provenance.search is not None
    proven = output.provenance.search.upper_bound_proven
    assert proven is not None
    assert upper_bound_beside(output, row) is not None
    assert upper_bound_beside(output, row | {output.goal.name: proven + 0.5}) is None  # its rounding
    with pytest.raises(UpperBoundExceededError, match="upper bound is"):
        upper_bound_beside(output, row | {output.goal.name: proven + 3})


@pytest.mark.parametrize("seed", [*range(2), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 60))])
def test_random_studies_show_each_bound_beside_its_own_design(tmp_path: Path, seed: int) -> None:
    random = np.random.default_rng(seed)
    names = ["day", "dusk", "night"][: random.integers(1, 4)]
    exposures = {name: float(10 ** random.uniform(-4, -2)) for name in names}
    cfas = [str(name) for name in random.permutation(list(CFAS))[: random.integers(1, 4)]]
    grids = {}
    for cfa in cfas:
        left, right = random.uniform(585, 625, 3), random.uniform(635, 690, 2)
        edges = {"left_nm": left, "left_width_nm": random.uniform(5, 50, 2), "right_nm": right}
        axes = [f"{n}: {sorted(values.round(2).tolist())}" for n, values in edges.items()]
        grids[cfa] = f"{{{', '.join(axes)}, right_width_nm: 7}}"
    searched, scenario = str(random.choice(cfas)), str(random.choice(names))
    text = study_text(exposures, grids, searched, scenario, float(random.choice([0.0, 0.6, 0.75])))
    check_shown_bounds(output_of(tmp_path, text))
