"""What can go wrong in a run: killed workers, damaged files, failing designs, other studies, clusters."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pandas as pd
import psutil
import pytest

from sweep.base.errors import FailedDesignError, InterruptedRunError, OutputError, SweepError
from sweep.report import read_output
from sweep.results.answers import ANSWERS
from sweep.results.identity import CHUNK, run_facts
from sweep.results.lock import locked
from sweep.runs import RunOptions, output_folder, remaining_work, remaining_work_lines, run_study
from sweep.runs.status import status
from sweep.runs.sweep import KILLED
from sweep.runs.workers import workers
from sweep.study import Study, load_study

from ..build import ran, study_file, text_of
from ..mischief import assert_same_tables, half_done, mischievous, rows


@pytest.fixture(scope="module")
def fewer(plain: Study) -> Study:
    """A sweep alone, with a tenth of its right edges: designs by their curves take longer."""
    sweep = plain.spaces[-1]
    few = replace(sweep, axes=(*sweep.axes[:2], sweep.axes[2][::10], *sweep.axes[3:]))
    return replace(plain, spaces=(*plain.spaces[:-1], few))


@pytest.fixture(scope="module")
def unharmed(fewer: Study, tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    """What a mischievous study gives when its file is missing."""
    folder = tmp_path_factory.mktemp("unharmed")
    ran(mischievous(fewer, folder / "missing"), folder, 1)
    return rows(folder)


@pytest.mark.slow
def test_a_worker_that_is_killed_once_costs_nothing(fewer: Study, unharmed: pd.DataFrame, tmp_path: Path) -> None:
    wish = tmp_path / "wish"
    wish.write_text("kill 1 ")
    ran(mischievous(fewer, wish), tmp_path / "out", 2)
    assert wish.read_text().split()[2] == "done"
    pd.testing.assert_frame_equal(rows(tmp_path / "out"), unharmed)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("scenes", ["a", "ab"])
def test_a_design_that_kills_its_worker_is_a_row(plain: Study, tmp_path: Path, scenes: str) -> None:
    """In one part with other designs, or with those of other scenes."""
    wish = tmp_path / "wish"
    wish.write_text("kill 1000000 ")
    few = replace(plain, scenarios=dict.fromkeys(scenes, plain.scenarios["chart"]))
    sweep = few.spaces[-1]
    few = replace(few, spaces=(replace(sweep, axes=((590.0, 600.0, 610.0), (5.0,), (660.0,), (5.0,), (1.0,))),))
    ran(mischievous(few, tmp_path / "missing"), tmp_path / "fine", 1)
    run_study(mischievous(few, wish), tmp_path / "out", 2, lambda *_: None, backend="loky")
    found, fine = rows(tmp_path / "out"), rows(tmp_path / "fine")
    killed = found["left_nm"] == 590
    assert list(found.loc[killed, "status"]) == [KILLED] * len(scenes)
    assert found.loc[killed, "csd_yellow_red"].isna().all()
    assert not found.loc[killed, "feasible"].any()
    words = {"status": str}  # the word of the killed rows is no category of the others
    pd.testing.assert_frame_equal(found[~killed].astype(words), fine[~killed].astype(words))


def test_failing_designs_stop_a_run_or_are_tried_again(fewer: Study, unharmed: pd.DataFrame, tmp_path: Path) -> None:
    wish = tmp_path / "wish"
    wish.write_text("fail ")
    study, folder = mischievous(fewer, wish), tmp_path / "out"
    with pytest.raises(FailedDesignError, match="no such filter"):
        run_study(study, folder, 1, lambda *_: None, options=RunOptions(fail_fast=True))
    assert run_study(study, folder, 1, lambda *_: None)
    failed = (rows(folder)["status"] != "ok").sum()
    assert f"failed: {failed:,} rows" in text_of(read_output(folder))
    assert failed == 2 * 2 * 6 * 2  # in both scenes, every design of this edge
    assert not run_study(study, folder, 1, lambda *_: None)
    wish.unlink()
    assert run_study(study, folder, 1, lambda *_: None, options=RunOptions(retry_failed=True))
    pd.testing.assert_frame_equal(rows(folder), unharmed)
    assert not run_study(study, folder, 1, lambda *_: None, options=RunOptions(retry_failed=True))


def test_status_and_dry_run_count_finished_designs(plain: Study, tmp_path: Path) -> None:
    folder, all_rows = tmp_path / "out", f"{plain.n_designs:,}"
    with pytest.raises(OutputError, match="no run here"):
        status(folder)
    assert remaining_work(plain, folder).finished == 0
    assert "Search: 4 starts, 200 evaluations at most." in remaining_work_lines(
        remaining_work(load_study(study_file(tmp_path, 2)), folder), folder
    )
    assert not folder.exists()
    half_done(plain, folder)
    done = len(rows(folder))  # readable while it runs
    assert f"{done:,} of {all_rows} designs" in status(folder).lines[0]
    assert remaining_work(plain, folder).finished == done
    with locked(folder):
        assert status(folder).lines[0].startswith("running")
    ran(plain, folder, 1)
    assert status(folder).lines[0].startswith(f"finished: {all_rows} designs in ")
    assert remaining_work(plain, folder).finished == plain.n_designs


def test_a_changed_study_goes_beside_the_old_one(plain: Study, tmp_path: Path) -> None:
    base = tmp_path / "tiny"
    ran(plain, base, 1)
    assert output_folder(base, run_facts(plain)) == (base, None)
    path = study_file(tmp_path)
    path.write_text(path.read_text().split("constraints:")[0].replace("exposure_s: 0.002", "exposure_s: 0.003"))
    changed = load_study(path)
    folder, note = output_folder(base, run_facts(changed))
    assert folder == tmp_path / "tiny-2"
    assert note is not None
    assert "changed scenarios.dim.exposure.exposure_s: 0.002 -> 0.003" in note
    with pytest.raises(OutputError, match="holds another study"):
        ran(changed, base, 1)
    ran(changed, folder, 1)
    assert output_folder(base, run_facts(changed))[0] == folder


@pytest.mark.parametrize(
    ("scheduler", "said"),
    [
        (None, "needs --scheduler"),
        pytest.param("tcp://127.0.0.1:9", "--scheduler tcp://127.0.0.1:9: ", marks=pytest.mark.slow),
    ],
)
def test_dask_needs_a_scheduler_that_answers(scheduler: str | None, said: str) -> None:
    with pytest.raises(SweepError, match=said), workers(2, "dask", scheduler):
        pass


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
def test_a_cluster_gives_the_same_rows_with_a_worker_killed(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    path = study_file(tmp_path, 101)
    path.write_text(path.read_text().replace("starts: 4", "starts: 2"))
    study = load_study(path)
    ran(study, tmp_path / "one", 1)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as cluster:
        killed: list[int] = []

        def kill_one(phase: str, done: int, _total: int) -> None:
            if phase == "designs" and done > CHUNK and not killed:
                worker = next(iter(cluster.workers.values()))
                killed.append(worker.process.pid)
                psutil.Process(worker.process.pid).kill()

        run_study(study, tmp_path / "many", 2, kill_one, backend="dask", scheduler=cluster.scheduler_address)
    assert killed
    assert_same_tables(tmp_path / "one", tmp_path / "many", "results", "search")


def test_a_search_that_was_killed_is_not_repeated(tmp_path: Path) -> None:
    study = load_study(study_file(tmp_path, 2))

    def stop(phase: str, done: int, _total: int) -> None:
        if phase == "search starts" and done == 2:
            raise KeyboardInterrupt

    with pytest.raises(InterruptedRunError):
        run_study(study, tmp_path / "out", 1, stop)
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "out" / ANSWERS).iterdir()}
    assert len(kept) == 2
    seen: list[dict[Path, int]] = []

    def look(phase: str, _done: int, _total: int) -> None:
        if phase == "designs" and not seen:
            seen.append({path: path.stat().st_mtime_ns for path in kept})

    run_study(study, tmp_path / "out", 1, look)
    assert seen == [kept]
    ran(study, tmp_path / "whole", 1)
    assert_same_tables(tmp_path / "out", tmp_path / "whole", "results", "search")
