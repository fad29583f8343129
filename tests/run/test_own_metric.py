"""A metric in a user's Python file: a column like any other, in sweep, search, workers, resume, report and Python."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.spatial.distance import cdist

import sweep
from sweep.base.errors import StudyError
from sweep.base.user_code import UserCode
from sweep.camera.linear import linear_model
from sweep.metrics.smooth import SmoothDesign
from sweep.report import read_output
from sweep.results.dataset import part_paths
from sweep.runs import run_study
from sweep.study import Study, load_study

from ..build import one_line, ran
from ..cases import thinned
from ..commanded import commanded
from ..hard.scenes import FAMILY, scene
from ..mischief import rows as rows_in
from ..rounding import gamma
from .own_codes import CODE, OWN_METRIC, PLAIN


def study(folder: Path, text: str = OWN_METRIC, code: str = CODE, *, allow: bool = True) -> Study:
    (folder / "mine.py").write_text(code)
    path = folder / "own.yaml"
    path.write_text(text)
    return load_study(path, allow_code=allow)


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
    assert found.search.no_upper_bound == "apart is an own metric, of which nothing is known"
    assert len(found.data_sha256["mine.py"]) == 64
    assert any("nothing is promised or proven of this metric" in warning for warning in found.warnings)
    kept = {
        column["name"]: column for column in json.loads((tmp_path / "own/provenance.json").read_text())["quantities"]
    }
    assert kept["apart"]["unit"] == "DN"
    assert kept["red_spread"]["direction"] == "less"
    assert pq.read_schema(part_paths(tmp_path / "own")[0]).field("apart").type == "double"


def test_less_is_searched_for_constrained_and_below_zero(tmp_path: Path) -> None:
    spread = "metrics: [mine.py:Spread, mine.py:below_zero]\n"
    least = PLAIN.replace("constraints:", f"{spread}objective: {{least: {{red_spread: 1}}}}\nconstraints:")
    made = study(tmp_path, least)
    run_study(made, tmp_path / "least", 1, lambda *_: None)
    rows = rows_in(tmp_path / "least")
    answer = rows[rows["kind"] == "search"].iloc[0]
    assert answer["objective"] == pytest.approx(-np.log10(answer["red_spread"]))
    feasible = rows[rows["feasible"] & (rows["kind"] == "sweep")]
    assert answer["red_spread"] <= feasible["red_spread"].min()
    bound = f"{answer['red_spread'] + 10:.1f}"
    text = PLAIN.replace("constraints:", f"{spread}objective: below_zero\nconstraints:\n  red_spread: {{max: {bound}}}")
    run_study(study(tmp_path, text), tmp_path / "below", 1, lambda *_: None)
    both = rows_in(tmp_path / "below")
    best = both[both["kind"] == "search"].iloc[0]
    np.testing.assert_allclose(both["below_zero"], both["csd_yellow_red"] - 1e4, rtol=1e-12)
    assert best["feasible"] or best["violation"] < 0.02  # rounding to whole DN
    inside = both[both["feasible"] & (both["kind"] == "sweep")]
    assert best["below_zero"] >= inside["below_zero"].max() - 2


def test_slopes_are_those_of_the_metric(tmp_path: Path) -> None:
    """Beside the exact slopes of the squared distances."""
    made = study(tmp_path, OWN_METRIC.replace("cfas: [RGGB, RYNCy]", "cfas: [RYNCy]"))
    own = made.quantities["apart"]
    exact = made.quantities["csd_yellow_red"]
    setup, free = scene("chart", "RYNCy", {}).setup, np.arange(5)
    design = SmoothDesign(
        linear_model(setup), FAMILY, np.array([600.0, 8, 640, 9, 0.8]), free, np.array([30.0, 10, 30, 10, 0.5])
    )
    assert own.smooth is not None
    assert exact.smooth is not None
    mine, squared = own.smooth(design), exact.smooth(design)
    np.testing.assert_allclose(mine.values**2, squared.values, rtol=1e-12)
    np.testing.assert_allclose(2 * mine.values[:, None] * mine.by_u, squared.by_u, rtol=1e-5, atol=1e-3)
    members = setup.members
    distances = cdist(design.response[0][members["yellow"]], design.response[0][members["red"]])
    assert own.value(mine) == pytest.approx(distances.min(), rel=1e-12)


def test_user_metric_of_user_filters_and_plain_cfas_in_python(tmp_path: Path) -> None:
    study(tmp_path, OWN_METRIC.replace("mine.py:apart,", "mine.py:apart, mine.py:only_n,"))
    made = sweep.load_study(tmp_path / "own.yaml", allow_code=True)
    table = made.evaluate(N=0.9 * made.curve("Y"))
    assert table["apart"][0] == pytest.approx(table["csd_yellow_red"][0], rel=1e-12)
    assert table.attrs["units"]["apart"] == "DN"
    plain = made.evaluate().set_index("name")
    assert np.isnan(plain.loc["RGGB", "only_n"])  # a CFA that it says nothing of
    assert plain.loc["mine", "only_n"] > 0


def test_code_of_a_metric_runs_only_when_it_is_allowed(tmp_path: Path) -> None:
    code = f"open({str(tmp_path / 'ran')!r}, 'w')\n{CODE}"
    with pytest.raises(
        StudyError, match=r"own.yaml:\d+: metrics.*names a Python file, whose code would run.*--allow-code"
    ):
        study(tmp_path, code=code, allow=False)
    assert commanded("run", tmp_path / "own.yaml")[0] == 2
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "class Spread",
            "class Spreads",
            "no such class or function in the file (got 'Spread'); allowed: apart, Spreads",
        ),
        ('readings.of("red")\n', 'readings.off("red")\n', "AttributeError: 'Readings' object has no attribute 'off'"),
        ("return np.linalg", "return np.nan * np.linalg", "mine.py:apart is not finite (got nan)"),
        (".reshape(len(one), -1)", "", "mine.py:apart gives another shape (got (3, "),
        (".reshape(len(one), -1)", ".min()", "mine.py:apart gives another shape (got ())"),
        ("return np.linalg", "return 'wide' or np.linalg", "mine.py:apart gives no numbers (got 'wide')"),
        ("    one, other = readings", "    readings.dn[:] = 0\n    one, other = readings", "read-only"),
        (".reshape(len(one), -1)", ".reshape(len(one), -1) + len(one)", "depends on the designs beside it"),
        ('"DN", "yellow', '3, "yellow', "`unit` is no short text (got 3)"),
        ('"red_spread", "less"', 'property(lambda self: 1 / 0), "less"', "mine.py:Spread: ZeroDivisionError"),
        ('"less"', '"fewer"', "no such `direction` (got 'fewer'); allowed: more, less"),
        (', direction = "', ', wanted = "', "`wanted` is named `direction`"),
        (
            '"red_spread"',
            '"sensitivity"',
            "another column has this name; the metric can say `name` (got 'sensitivity')",
        ),
        ('"red_spread"', '"red spread"', "no usable `name` (got 'red spread')"),
        ("digits = ", "digits, _ = ", "the code cannot be run: ValueError"),
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
        (OWN_METRIC.replace("mine.py:Spread", "mine.py:apart"), "another column has this name"),
        (OWN_METRIC.replace("mine.py:Spread", "spreads"), "unknown metric (got 'spreads')"),
        (OWN_METRIC.replace("mine.py:Spread", "other.py:Spread"), "no such file (got 'other.py')"),
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
