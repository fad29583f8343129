"""What becomes of designs whose block cannot be computed as it should: the right rows, and never in silence."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sweep.base.disk import read_facts
from sweep.designs.block import EdgeBlock
from sweep.designs.families.stopband import MultiStopband, Stopband
from sweep.designs.space import Filter
from sweep.report import read_output, summary_lines
from sweep.results.identity import CHUNK
from sweep.run import Wishes, routes, run_study
from sweep.run.routes import ALONE, BY_CURVES
from sweep.run.rows import Job, detours_of, rules_of, run_job
from sweep.study import Study

from ..build import ran
from ..mischief import StoppedError, mischievous, plant, rows
from ..rounding import assert_tables_within_rounding, brightest_dn

FAULT = "KeyError: 'planted'"


def with_edges(study: Study) -> int:
    """Designs with edges: the named one and those of the sweep."""
    return len(study.scenarios) * sum(space.size for space in study.spaces if space.filter is not None)


def test_a_fault_of_the_fast_way_is_told_and_changes_no_row(
    plain: Study, whole: pd.DataFrame, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant(monkeypatch)
    looked: list[int] = []
    monkeypatch.setattr(Stopband, "curves", counting(looked, Stopband.curves))
    ran(plain, tmp_path, 1)
    assert max(looked) == CHUNK  # blocks, not designs one by one
    found = rows(tmp_path)
    assert (found["status"] == "ok").all()
    numbers = found.select_dtypes("number").columns
    # Two orders of the same sums; a digital number could be rounded the other way, which moves a CSD by 2 DN at most.
    csd = [name for name in numbers if name.startswith("csd_")]
    others = [name for name in numbers if name not in csd]
    np.testing.assert_allclose(found[others], whole[others], rtol=1e-12, atol=1e-12)
    assert np.abs(found[csd] - whole[csd]).max(axis=None) <= 2
    told = f"{with_edges(plain):,} designs were {BY_CURVES} ({FAULT})"
    facts = read_facts(tmp_path / "provenance.json")
    assert facts["warnings"].count(told) == 1
    assert facts["detours"] == [{"how": BY_CURVES, "why": FAULT, "designs": with_edges(plain)}]
    assert f"Note: {told}." in summary_lines(read_output(tmp_path))


def counting(looked: list[int], way: Any) -> Any:
    def counted(self: Any, x: np.ndarray) -> Any:
        looked.append(len(x))
        return way(self, x)

    return counted


@pytest.mark.slow
def test_detours_before_a_kill_are_told_after_it_and_mended_when_asked(
    plain: Study, whole: pd.DataFrame, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(phase: str, done: int, _total: int) -> None:
        if phase == "designs" and done > CHUNK:
            raise StoppedError

    with monkeypatch.context() as patch:
        plant(patch)
        with pytest.raises(StoppedError):
            run_study(plain, tmp_path, 1, stop)
    ran(plain, tmp_path, 1)
    (detour,) = read_facts(tmp_path / "provenance.json")["detours"]
    assert detour == {"how": BY_CURVES, "why": FAULT, "designs": 1 + CHUNK}  # with the named one
    (tmp_path / "results.parquet").unlink()  # what makes the rows be computed again
    ran(plain, tmp_path, 1)
    assert read_facts(tmp_path / "provenance.json")["detours"] == []
    pd.testing.assert_frame_equal(rows(tmp_path), whole)


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


@pytest.mark.parametrize("chunk", [CHUNK, 7])
@pytest.mark.parametrize("separable", [True, False])
def test_designs_beside_a_bad_one_are_those_of_a_whole_block_within_rounding(
    plain: Study, monkeypatch: pytest.MonkeyPatch, separable: bool, chunk: int
) -> None:
    """A block of several chunks is taken apart: only designs of a bad one's own chunk take another route."""
    monkeypatch.setattr(routes, "CHUNK", chunk)
    job, setup, rules = fragile_job(plain, FragileEdges if separable else Fragile)
    whole = Stopband if separable else MultiStopband
    fine = run_job(*fragile_job(plain, whole)).to_pandas()
    assert not detours_of(run_job(*fragile_job(plain, whole)))
    if separable:  # a bad design breaks the fast way, too
        way = EdgeBlock.product

        def broken(self: EdgeBlock, *arguments: Any) -> Any:
            if (self.space.points_of(self.numbers)[:, 0] == 600).any():
                raise ValueError("no such edge")
            return way(self, *arguments)

        monkeypatch.setattr(EdgeBlock, "product", broken)
    table = run_job(job, setup, rules)
    found = table.to_pandas()
    bad = found["left_nm"] == 600
    assert set(found.loc[bad, "status"]) == {"error: ValueError: no such filter at all"}
    chunks = found["design_id"] // chunk
    beside = ~bad & chunks.isin(set(chunks[bad]))
    assert detours_of(table) == {
        (ALONE, f"ValueError: {'no such edge' if separable else 'no such filter at all'}"): int(beside.sum())
    }
    same = [name for name in found.columns if name != "pareto"]
    words = {"status": str}
    both = [table.loc[~bad, same].astype(words) for table in (found, fine)]
    magnitude_dn = brightest_dn(setup, job.space.curves(job.space.points(0, 1), plain.grid.size))
    assert_tables_within_rounding(*both, setup, magnitude_dn, given=job.space.parameters)


def test_a_run_says_how_many_designs_were_computed_one_by_one(plain: Study, tmp_path: Path) -> None:
    wish = tmp_path / "wish"
    wish.write_text("fail ")
    few = replace(plain.spaces[-1], axes=((590.0, 600.0, 610.0), (5.0,), (660.0, 670.0), (5.0,), (1.0,)))
    study = mischievous(replace(plain, spaces=(*plain.spaces[:-1], few)), wish)
    run_study(study, tmp_path / "out", 1, lambda *_: None)
    found = rows(tmp_path / "out")
    assert (found["status"] != "ok").sum() == 2 * 2
    assert read_facts(tmp_path / "out" / "provenance.json")["warnings"] == [
        f"8 designs were {ALONE} (ValueError: no such filter)"
    ]
    wish.unlink()
    assert run_study(study, tmp_path / "out", 1, lambda *_: None, wishes=Wishes(retry_failed=True))
    assert read_facts(tmp_path / "out" / "provenance.json")["detours"] == []
