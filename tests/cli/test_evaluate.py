"""`sweep evaluate`: one filter beside RGGB, the CFA that it changes, and the limit."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import sweep

from ..commanded import commanded
from ..curve_texts import WAVE, bell, csv


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """A transmission in percent, 300 to 800 nm."""
    nm = np.arange(300.0, 801)
    return csv(tmp_path, "wavelength_nm,T", nm, np.where(abs(nm - 630) < 15, 20.0, 95.0), name="filter.csv")


def test_the_limit_is_of_filters_with_as_much_light(own: Path) -> None:
    """A filter that attains it has no gap; one that is darker than the limit's other end has one."""
    study = sweep.make_study(
        cfas=["RYYCy", "RYNCy"],
        boxes={"any": {"cfa": "RYNCy", "channel": "N", "base": "Y", "to": 0.0}},
        constraints={"sensitivity": {"min": 0.9}},
    )
    limit = study.upper_bound()
    assert limit.curve is not None
    best = pd.DataFrame({"N (QE)": limit.curve}, index=pd.Index(study.wavelength_nm, name="wavelength_nm"))
    best.to_csv(own.with_name("best.csv"))
    found = sweep.evaluate(own.with_name("best.csv"))
    assert found.gap is not None
    assert found.gap < 1e-4
    assert found.upper_bound == pytest.approx(limit.proven, abs=0.01)
    mine = sweep.evaluate(own, relative_to="Y")
    assert mine.upper_bound is not None
    assert mine.before_quantization_dn is not None
    assert mine.gap == pytest.approx(1 - mine.before_quantization_dn / mine.upper_bound)
    assert 0.01 < mine.gap < 1


def test_own_sensor_and_lights(tmp_path: Path, own: Path) -> None:
    qe = csv(
        tmp_path,
        "wavelength_nm,R,G,B,W",
        WAVE,
        *(bell(c, 40) * 0.5 for c in (620, 540, 460)),
        bell(560, 150) * 0.8,
        name="qe.csv",
    )
    leds = csv(tmp_path, "wavelength_nm,a,b,c", WAVE, *(bell(c, 12) for c in (505, 592, 636)), name="leds.csv")
    requested = ("evaluate", own, "--transmission", "--sensor", qe, "--lights", leds)
    said = commanded(*requested)[1]
    assert "assumed to be percent, times W; it is N of RGBN" in said
    assert "no filter between 0 and W" in said  # though the filter is the brightest on white, and sets the exposure


def test_a_filter_a_little_above_the_curve_it_replaces_has_a_limit_too(tmp_path: Path) -> None:
    """As one of few samples is: every 10 nm of Y lies above Y in places."""
    any_filter = {"cfa": "RYNCy", "channel": "N", "base": "Y", "to": 0.0}
    study = sweep.make_study(cfas=["RYYCy", "RYNCy"], boxes={"any": any_filter})
    y, nm = study.curve("Y").to_numpy(), study.wavelength_nm
    few = nm[::10]
    sampled = np.interp(nm, few, y[::10] * np.where(abs(few - 640) < 15, 0.4, 1.0))
    found = sweep.evaluate(csv(tmp_path, "wavelength_nm,N [QE]", nm, sampled, name="few.csv"))
    assert (sampled > y).any()
    assert found.before_quantization_dn <= found.upper_bound


@pytest.mark.parametrize(
    ("requested", "said"),
    [
        (["filter.csv", "--channel", "Q"], "--channel: no such channel of RYNCy"),
        (["filter.csv", "--column", "t"], "--column: no such column (got 't'); did you mean 'T'?; allowed: T"),
        (["filter.csv", "--sensor", "ar0802"], "did you mean 'ar0820'?"),
        (["filter.csv", "--design", "best"], "`design` requires a run folder"),
        (["above.csv"], "values up to 1.5 are no transmission"),
    ],
)
def test_faults_are_lines(own: Path, monkeypatch: pytest.MonkeyPatch, requested: list[str], said: str) -> None:
    monkeypatch.chdir(own.parent)
    csv(own.parent, "wavelength_nm,T", WAVE, np.full(WAVE.size, 1.5), name="above.csv")
    code, out, err = commanded("evaluate", *requested)
    assert (code, out, said in err, err.count("\n")) == (2, "", True, 1)


def test_evaluate_loads_no_unneeded_modules(own: Path) -> None:
    """Most of the time that the command takes is that of loading; figures, workers and compiled code are not for it."""
    code = "import sys; from sweep.cli.app import app\ntry: app(['evaluate', sys.argv[1], '--relative-to', 'Y'])\n"
    code += "except SystemExit: pass\nprint(*sys.modules, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code, own], capture_output=True, text=True, check=True)
    assert "below" in done.stdout  # the gap to the limit: everything was computed
    loaded = set(done.stderr.split())
    assert {"numpy", "scipy.optimize"} <= loaded
    assert not loaded & {"numba", "scipy.stats", "pandas", "matplotlib", "colour", "sklearn", "joblib", "jinja2"}


@pytest.mark.usefixtures("plain_pictures")
def test_a_design_of_a_run_is_held_against_all_that_the_run_constrains(tmp_path: Path) -> None:
    """Also what its curve alone does not tell; lamps without a constrained type leave that out, and say so."""
    keys = {
        "constraints": {"edge_width_nm": {"min": 5}, "csd_orange_red": {"min": 1}},
        "production": {"edge_shift_nm": 1},
    }
    study = sweep.make_study(
        "small",
        cfas=["RYNCy"],
        designs={
            "one": {"cfa": "RYNCy", "family": "stopband", "channel": "N", "base": "Y", "to": "G", "at": "paper_N4"}
        },
        **keys,
    )
    run = study.run(tmp_path, jobs=1)
    found = sweep.evaluate(run.folder, design="one")
    assert found.violated == []
    row, of_run = found.table.iloc[-1], run.table.iloc[-1]
    for column in ("edge_width_nm", "worst_csd_yellow_red"):
        assert row[column] == pytest.approx(of_run[column])
    leds = csv(tmp_path, "wavelength_nm,b,c", WAVE, *(bell(c, 12) for c in (592, 636)), name="leds.csv")
    code, out, _ = commanded("evaluate", run.folder, "--design", "one", "--lights", leds)
    assert (code, "csd_orange_red is not computed here." in out) == (0, True)
