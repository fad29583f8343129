"""Studies that misbehave on demand, and runs that are broken off."""

from __future__ import annotations

import os
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from sweep.designs.families.stopband import MultiStopband
from sweep.designs.space import Filter
from sweep.results.dataset import part_paths
from sweep.results.identity import CHUNK
from sweep.runs import run_study
from sweep.study import Study


class Mischief(MultiStopband):
    """A band, by its curves, that does as its file says where its left edge is at 590 nm: `kill N` (N times), or `fail`."""

    file: Path

    def hull(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A plan asks for it; the mischief is done for a single design."""
        self._misbehave(low[None] if (low == high).all() else np.empty((0, low.size)))
        return super().hull(low, high)

    def curves(self, x: np.ndarray) -> np.ndarray:
        self._misbehave(x)
        return super().curves(x)

    def _misbehave(self, x: np.ndarray) -> None:
        if (x[:, 0] == 590).any() and self.file.exists():
            wish = self.file.read_text().split()
            with self.file.open("a") as handle:
                handle.write("done\n")
            if wish[0] == "kill" and len(wish) <= int(wish[1]) + 1:
                os.kill(os.getpid(), signal.SIGKILL)
            if wish[0] == "fail":
                raise ValueError("no such filter")


def mischievous(study: Study, file: Path) -> Study:
    """The study with a sweep whose first left edge does what `file` says."""
    sweep = study.spaces[-1]
    assert sweep.filter is not None
    family = Mischief(study.grid.nodes_nm, study.sensor.qe["Y"], study.sensor.qe["G"], 1)
    family.file = file
    made = replace(sweep, filter=Filter(family, sweep.filter.bases, sweep.filter.target))
    return replace(study, spaces=(*study.spaces[:-1], made))


def rows(folder: Path) -> pd.DataFrame:
    return pd.read_parquet(folder / "results.parquet")


def assert_same_tables(one: Path, other: Path, *names: str) -> None:
    """Tables of two runs are bit for bit the same; without names, their rows."""
    for name in names or ("results",):
        assert pq.read_table(one / f"{name}.parquet").equals(pq.read_table(other / f"{name}.parquet")), name


class StoppedError(Exception):
    pass


def half_done(study: Study, folder: Path) -> list[Path]:
    """The parts of a run that was broken off after two whole chunks."""

    def stop(phase: str, done: int, _total: int) -> None:
        if phase == "designs" and done > 2 * CHUNK:
            raise StoppedError

    with pytest.raises(StoppedError):
        run_study(study, folder, 1, stop)
    return part_paths(folder)
