"""Designs whose block fails: each that can be computed is, and the others are rows with their faults."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sweep.designs.block import EdgeBlock
from sweep.designs.families.stopband import MultiStopband, Stopband
from sweep.designs.space import Filter
from sweep.run.rows import Job, rules_of, run_job
from sweep.study import Study

from ..rounding import assert_tables_within_rounding, brightest_dn


class Fragile(MultiStopband):
    """A stopband that has no curves at one left edge, and no edges in a block with it; else like any other."""

    def curves(self, x: np.ndarray) -> Any:
        if (x[:, 0] == 600).any():
            raise ValueError("no such filter\nat all")
        return super().curves(x)


class FragileEdges(Fragile, Stopband):
    """The same, computed by its edges."""


def fragile_job(study: Study, kind: type[MultiStopband]) -> tuple[Job, Any, Any]:
    bands = () if issubclass(kind, Stopband) else (1,)
    family = kind(study.grid.nodes_nm, study.sensor.qe["Y"], study.sensor.qe["G"], *bands)
    axes = ((590.0, 600.0, 610.0, 655.5), (5.0, 20.0), (640.0, 650.0, 660.0), (5.0,), (0.3, 1.0))
    space = replace(study.spaces[-1], filter=Filter(family, {"N": "Y"}, "G"), axes=axes)
    return Job(space, "chart", 0, space.size, 0, 0), study.setup(space, "chart"), rules_of(study)


@pytest.mark.parametrize("separable", [True, False])
def test_designs_beside_a_bad_one_are_those_of_a_whole_block_within_rounding(
    plain: Study, monkeypatch: pytest.MonkeyPatch, separable: bool
) -> None:
    job, setup, rules = fragile_job(plain, FragileEdges if separable else Fragile)
    fine = run_job(*fragile_job(plain, Stopband if separable else MultiStopband)).to_pandas()
    if separable:
        product = EdgeBlock.product

        def broken(self: EdgeBlock, *arguments: Any) -> Any:
            if (self.space.points_of(self.numbers)[:, 0] == 600).any():
                raise ValueError("no such edge")
            return product(self, *arguments)

        monkeypatch.setattr(EdgeBlock, "product", broken)
    table = run_job(job, setup, rules).to_pandas()
    bad = table["left_nm"] == 600
    fault = "no such edge" if separable else "no such filter at all"
    assert set(table.loc[bad, "status"]) == {f"error: ValueError: {fault}"}
    same = [name for name in table.columns if name != "pareto"]
    both = [frame.loc[~bad, same].astype({"status": str}) for frame in (table, fine)]
    magnitude_dn = brightest_dn(setup, job.space.curves(job.space.points(0, 1), plain.grid.size))
    assert_tables_within_rounding(*both, setup, magnitude_dn, given=job.space.parameters)
