"""A metric in a user's Python file: a column like any other, in sweep, search, workers, resume, report and Python."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sweep
from sweep.base.user_code import UserCode
from sweep.report import read_output
from sweep.study import Study, load_study

from ..build import one_line, ran
from ..cases import thinned
from ..mischief import rows as rows_in
from ..rounding import gamma
from .own_codes import CODE, OWN_METRIC, PLAIN


def study(folder: Path, text: str = OWN_METRIC, code: str = CODE) -> Study:
    (folder / "mine.py").write_text(code)
    path = folder / "own.yaml"
    path.write_text(text)
    return load_study(path, allow_code=True)


@pytest.mark.parametrize("jobs", thinned([1, 2]))
def test_a_csd_written_again_has_the_same_numbers_and_the_same_optimum(tmp_path: Path, jobs: int) -> None:
    ran(study(tmp_path), tmp_path / "own", jobs)
    ran(study(tmp_path, PLAIN), tmp_path / "plain", 1)
    own, plain = rows_in(tmp_path / "own"), rows_in(tmp_path / "plain")
    np.testing.assert_allclose(own["apart"], own["csd_yellow_red"], rtol=1e-12)
    swept = own["kind"] != "search"
    # Distances of whole digital numbers are equal by their edges and by their curves; sums over wavelengths are rounded.
    np.testing.assert_array_equal(own.loc[swept, "csd_yellow_red"], plain.loc[swept, "csd_yellow_red"])
    light = (table.loc[swept, "sensitivity"].to_numpy() for table in (own, plain))
    np.testing.assert_allclose(*light, rtol=gamma(301 + 16), atol=0)
    found, exact = (read_output(tmp_path / name).provenance for name in ("own", "plain"))
    assert found.search is not None
    assert exact.search is not None
    assert found.search.best_smooth_objective == pytest.approx(exact.search.best_smooth_objective, abs=0.01)
    assert found.search.upper_bound_proven is None
    assert "mine.py" in found.data_sha256


def test_less_is_constrained_and_what_is_below_zero_is_searched_for(tmp_path: Path) -> None:
    spread = "metrics: [mine.py:Spread, mine.py:below_zero]\n"
    text = PLAIN.replace("constraints:", f"{spread}objective: below_zero\nconstraints:\n  red_spread: {{max: 30}}")
    ran(study(tmp_path, text), tmp_path / "below", 1)
    both = rows_in(tmp_path / "below")
    best = both[both["kind"] == "search"].iloc[0]
    assert best["feasible"] or best["violation"] < 0.02  # rounding to whole DN
    inside = both[both["feasible"] & (both["kind"] == "sweep")]
    assert best["below_zero"] >= inside["below_zero"].max() - 2


def test_user_metric_of_user_filters_and_plain_cfas_in_python(tmp_path: Path) -> None:
    study(tmp_path, OWN_METRIC.replace("mine.py:apart,", "mine.py:apart, mine.py:only_n,"))
    made = sweep.load_study(tmp_path / "own.yaml", allow_code=True)
    table = made.evaluate(N=0.9 * made.curve("Y"))
    assert table["apart"][0] == pytest.approx(table["csd_yellow_red"][0], rel=1e-12)
    plain = made.evaluate().set_index("name")
    assert np.isnan(plain.loc["RGGB", "only_n"])  # a CFA that it says nothing of
    assert plain.loc["mine", "only_n"] > 0


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('readings.of("red")\n', 'readings.off("red")\n', "AttributeError: 'Readings' object has no attribute 'off'"),
        ("return np.linalg", "return np.nan * np.linalg", "mine.py:apart is not finite (got nan)"),
        (".reshape(len(one), -1)", "", "mine.py:apart gives another shape (got (3, "),
        ("return np.linalg", "return 'wide' or np.linalg", "mine.py:apart gives no numbers (got 'wide')"),
        ("    one, other = readings", "    readings.dn[:] = 0\n    one, other = readings", "read-only"),
        (".reshape(len(one), -1)", ".reshape(len(one), -1) + len(one)", "depends on the designs beside it"),
        ('"red_spread", "less"', 'property(lambda self: 1 / 0), "less"', "mine.py:Spread: ZeroDivisionError"),
        ('"less"', '"fewer"', "no such `direction` (got 'fewer'); allowed: more, less"),
        ('"red_spread"', '"sensitivity"', "another column has this name"),
        ('"red_spread"', '"red spread"', "no usable `name` (got 'red spread')"),
    ],
)
def test_faults_of_a_metric_are_one_line_before_any_work(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in CODE
    with one_line("own.yaml:", said):
        study(tmp_path, code=CODE.replace(old, new))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            OWN_METRIC.replace("objective: apart", "objective: red_spread"),
            "less of red_spread is better; allowed: `{least:",
        ),
        (
            OWN_METRIC.replace("constraints:", "constraints:\n  apart: {max: 3}"),
            "apart has no `max` (got 3.0); allowed: `min`",
        ),
    ],
)
def test_invalid_user_metrics_of_a_study_are_refused(tmp_path: Path, text: str, said: str) -> None:
    with one_line(said):
        study(tmp_path, text)


def test_a_file_may_have_dataclasses_and_types(tmp_path: Path) -> None:
    typed = "from __future__ import annotations\nfrom dataclasses import dataclass\n" + CODE.replace(
        "class Spread:", "@dataclass\nclass Spread:\n    times: float = 1.0"
    )
    assert "mine.py:Spread" in study(tmp_path, code=typed).section.metrics
    plain = typed.replace("from __future__ import annotations\n", "")
    made = UserCode("mine.py:apart", plain.replace("def apart(readings)", "def apart(readings: np.ndarray)")).loaded
    assert made.__annotations__ == {"readings": np.ndarray}
