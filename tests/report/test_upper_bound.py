"""An upper bound stands beside the designs that it bounds, and beside no others."""

from __future__ import annotations

import math
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from sweep.base.errors import UpperBoundExceededError
from sweep.report.page import report_of
from sweep.report.run import Run
from sweep.report.tables import PROVEN
from sweep.results.output import Output

from ..build import output_of

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
    """Check every upper bound that the page shows; return how many there are."""
    search, run, shown = output.provenance.search, Run(output), 0
    assert search is not None
    report = report_of(output)
    for section in (report.lead, *report.sections):
        for name, row in (section.table.rows if section.table else {}).items():
            if name.startswith(PROVEN):
                assert name.endswith(f"{search.channel} of {search.cfa}")
                shown += 1
                own = output.table[(output.table["scenario"] == run.scene) & (output.table["cfa"] == search.cfa)]
                own = own[own["feasible"] & own["kind"].isin(["sweep", "search"])]
                rounding = math.sqrt(len(output.mosaic(search.cfa).channels))
                assert not len(own) or own[output.goal.name].max() <= row["goal"] + rounding  # type: ignore[operator]
    return shown


GRID = "{left_nm: [600, 606, 612], left_width_nm: [6, 30], right_nm: [646, 652], right_width_nm: 7}"


def test_the_bound_of_one_scenario_is_not_shown_beside_the_designs_of_another(tmp_path: Path) -> None:
    text = study_text({"day": 2e-4, "night": 5e-3}, {"RYNCy": GRID}, "RYNCy", "day", 0.9)
    output = output_of(tmp_path, text)
    assert check_shown_bounds(output) >= 1
    assert Run(output).scene == "day"  # the search's


def test_a_value_above_its_own_bound_is_an_error(tmp_path: Path) -> None:
    text = study_text({"chart": 2e-3}, {"RYNCy": GRID}, "RYNCy", "chart", 0.9)
    output = output_of(tmp_path, text)
    assert output.provenance.search is not None
    proven = output.provenance.search.upper_bound_proven
    assert proven is not None
    for above, raises in ((0.5, False), (3.0, True)):  # its rounding, and more
        run = Run(output)
        run.here[run.hero][output.goal.name] = proven + above
        with pytest.raises(UpperBoundExceededError, match="upper bound is") if raises else nullcontext():
            assert run.bound is not None


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
