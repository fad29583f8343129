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


def rows(said: str) -> dict[str, list[str]]:
    """Cells of the table that the command prints, by CFA."""
    lines = [line.replace(" DN", "").split() for line in said.splitlines() if line.count(" DN  ") > 1]
    return {cells[0]: cells[1:] for cells in lines}


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
    code, said, err = commanded(*requested)
    assert (code, err) == (0, "")
    assert "values up to 95 are assumed to be percent, times W; it is N of RGBN, in place of W" in said
    assert list(rows(said)) == ["RGGB", "RGBW", "RGBN"]
    assert "no filter between 0 and W" in said  # though the filter is the brightest on white, and sets the exposure


def test_a_filter_a_little_above_the_curve_it_replaces_has_a_limit_too(tmp_path: Path) -> None:
    """As one of few samples is: every 10 nm of Y lies above Y in places. No filter that leaves the exposure exceeds it."""
    any_filter = {"cfa": "RYNCy", "channel": "N", "base": "Y", "to": 0.0}
    study = sweep.make_study(cfas=["RYYCy", "RYNCy"], boxes={"any": any_filter})
    y, nm = study.curve("Y").to_numpy(), study.wavelength_nm
    few = nm[::10]
    sampled = np.interp(nm, few, y[::10] * np.where(abs(few - 640) < 15, 0.4, 1.0))
    found = sweep.evaluate(csv(tmp_path, "wavelength_nm,N [QE]", nm, sampled, name="few.csv"))
    assert (sampled > y).any()
    assert "no filter between 0 and the larger of Y and itself, which leaves the exposure to other pixels," in str(
        found
    )
    assert found.before_quantization_dn <= found.upper_bound
    stops = [np.where((nm > a) & (nm < a + w), 0.5, 1.0) for a in range(560, 680, 10) for w in (10, 30, 50)]
    rivals = np.maximum(y, sampled) * np.array(stops)
    rivals = rivals[(rivals.sum(axis=1) <= y.sum()) & (rivals.sum(axis=1) >= sampled.sum())]
    assert len(rivals) > 2
    # The table's are rounded: two of four steps.
    assert study.evaluate(N=rivals)["csd_yellow_red"].max() <= found.upper_bound + 2


@pytest.mark.parametrize(
    ("requested", "said"),
    [
        (["filter.csv", "--channel", "Q"], "--channel: no such channel of RYNCy (got 'Q'); allowed: R, Y, N, Cy"),
        (["filter.csv", "--cfa", "RYQ"], "not the name of a 2x2 CFA"),
        (["filter.csv", "--cfa", "RQNCy"], "which channel of RQNCy is the filter?"),
        (["filter.csv", "--column", "t"], "--column: no such column (got 't'); allowed: T; did you mean 'T'?"),
        (["filter.csv", "--relative-to", "Z"], "unknown curve (got 'Z')"),
        (["filter.csv", "--sensor", "ar0802"], "did you mean 'ar0820'?"),
        (["filter.csv", "--lights", "t16"], "did you mean 'tl16'?"),
        (["filter.csv", "--design", "best"], "`design` requires a run folder"),
        (["filter.csv", "--allow-code"], "`allow-code` requires a run folder"),
        (["above.csv"], "values up to 1.5 are no transmission"),
    ],
)
def test_faults_are_lines(own: Path, monkeypatch: pytest.MonkeyPatch, requested: list[str], said: str) -> None:
    monkeypatch.chdir(own.parent)
    csv(own.parent, "wavelength_nm,T", WAVE, np.full(WAVE.size, 1.5), name="above.csv")
    code, out, err = commanded("evaluate", *requested)
    assert (code, out) == (2, "")
    assert said in err
    assert len(err.splitlines()) == 1


def loaded_by(*requested: object) -> tuple[str, set[str]]:
    """What the command says of these arguments, and all modules that it loads."""
    code = f"import sys; from sweep.cli.app import app\ntry: app({[*map(str, requested)]!r})\n"
    code += "except SystemExit: pass\nprint(*sys.modules, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout, set(done.stderr.split())


def test_evaluate_loads_no_unneeded_modules(own: Path) -> None:
    """Most of the time that the command takes is that of loading; figures, workers and compiled code are not for it."""
    said, loaded = loaded_by("evaluate", own, "--relative-to", "Y")
    assert "below" in said  # the gap to the limit: everything was computed
    assert {"numpy", "scipy.optimize"} <= loaded
    assert not loaded & {
        "numba",
        "scipy.interpolate",
        "scipy.stats",
        "pandas",
        "matplotlib",
        "colour",
        "sklearn",
        "joblib",
        "jinja2",
        "moocore",
    }


def test_a_filter_is_held_against_the_constraints_of_a_study_and_read_alike_in_python(own: Path) -> None:
    code, said, _ = commanded("evaluate", own)
    assert code == 0
    table = sweep.load_study("stopband").evaluate(N=own)
    (line,) = (line for line in said.splitlines() if line.startswith("Constraints of the study stopband"))
    assert table.violated[0] == "sensitivity, slope_per_nm"
    assert f"not met: sensitivity {table.sensitivity[0]:.4g} (>= 0.9)" in line
    assert rows(said)["RYNCy"][0] == f"{table.csd_yellow_red[0]:.1f}"
    wide = csv(own.parent, "wavelength_nm,T", np.array([400.0, 700.0]), np.array([95.0, 95.0]), name="wide.csv")
    assert "(sensitivity >= 0.9, slope_per_nm <= 0.06): met." in commanded("evaluate", wide)[1]
