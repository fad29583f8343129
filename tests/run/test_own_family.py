"""A family in a user's Python file: through sweep, search, workers, resume and report, and never without being asked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sweep
from sweep.base.errors import SweepError
from sweep.designs.plugin import PluginFamily
from sweep.runs import run_study
from sweep.study import Study, load_study

from ..build import one_line, ran
from ..commanded import COMMANDS, commanded
from .own_codes import CODE, OWN_FAMILY, OWN_METRIC, STOPBAND


def study(folder: Path, text: str = OWN_FAMILY, code: str = STOPBAND) -> Study:
    (folder / "filters.py").write_text(code)
    (folder / "own.yaml").write_text(text)
    return load_study(folder / "own.yaml", allow_code=True)


def test_a_run_is_exported_audited_and_evaluated_with_its_stored_code(tmp_path: Path) -> None:
    ran(study(tmp_path), tmp_path / "out", 1)
    for verb in (verb for verb in (("audit",), ("evaluate",), ("export", "--design", "best")) if verb[0] in COMMANDS):
        command = (*verb, tmp_path / "out", "--data", tmp_path)
        assert commanded(*command)[0] == 2
        assert commanded(*command, "--allow-code")[0] == 0
    (tmp_path / "filters.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\n{STOPBAND}")
    code, _, said = commanded("audit", tmp_path / "out", "--data", tmp_path, "--allow-code")
    assert (code, "not the code that the run had" in said) == (2, True)
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize(("text", "file", "own"), [(OWN_FAMILY, "filters.py", STOPBAND), (OWN_METRIC, "mine.py", CODE)])
def test_code_runs_only_when_it_is_allowed(tmp_path: Path, text: str, file: str, own: str) -> None:
    (tmp_path / file).write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\n{own}")
    (tmp_path / "own.yaml").write_text(text)
    with pytest.raises(SweepError, match="names a Python file, whose code would run"):
        load_study(tmp_path / "own.yaml")
    for command in (("check",), ("plan",), ("run",), ("run", "--dry-run")):
        assert commanded(*command, tmp_path / "own.yaml")[0] == 2
    assert commanded("list", tmp_path)[0] == 0
    assert not (tmp_path / "ran").exists()
    assert commanded("check", tmp_path / "own.yaml", "--allow-code")[0] == 0
    assert (tmp_path / "ran").exists()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("class Band", "class Bend", "no such class or function in the file (got 'Band'); allowed: Bend"),
        ("import numpy as np\n", "import sys\ndel sys.modules[__name__]\nimport nump\n", "run: ModuleNotFoundError"),
        ('("left_nm", 400, 700)', '("left_nm", 700, 400)', "no usable `parameters`"),
        ("self.wave, self.base", "self.wave, self.bases", "AttributeError: 'Band' object has no attribute 'base'"),
        ("return self.base + ", "return 2 + ", "a curve is out of its bounds"),
        ("return self.base + ", "return np.nan * ", "curves is not finite"),
        ("return self.base + ", "return (self.base + ", "SyntaxError"),
    ],
)
def test_faults_of_the_code_are_lines(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in STOPBAND
    with one_line(said):
        run_study(study(tmp_path, code=STOPBAND.replace(old, new)), tmp_path / "out", 1, lambda *_: None)


def test_bounds_and_gradients_hold(tmp_path: Path) -> None:
    """Bounds: of 500 filters. Curves and gradients: beside the built-in family's exact ones."""
    made = study(tmp_path)
    space = next(s for s in made.spaces if s.kind == "sweep")
    assert space.filter is not None
    own = space.filter.family
    assert isinstance(own, PluginFamily)
    exact = sweep.Stopband(made.grid.nodes_nm, made.sensor.curve("Y"), made.sensor.curve("G"))
    low, high = np.array([580.0, 5, 640, 5]), np.array([620.0, 40, 680, 40])
    points = low + np.random.default_rng(3).random((500, 4)) * (high - low)
    points = points[(own.violation(points) <= 0).all(axis=1)]
    assert len(points) > 100
    curves = own.curves(points)
    np.testing.assert_allclose(curves, exact.curves(np.pad(points, ((0, 0), (0, 1)), constant_values=1)), rtol=1e-9)
    assert (curves >= own.lower(low, high)).all()
    assert (curves <= own.upper(low, high)).all()
    for point in points[:20]:
        mine, theirs = own.gradient(point), exact.gradient(np.append(point, 1.0))[:4]
        np.testing.assert_allclose(mine, theirs, atol=2e-4 * abs(theirs).max())


def test_edges_of_a_user_family_are_not_shifted(tmp_path: Path) -> None:
    with pytest.raises(SweepError, match="has no edges that production could shift"):
        study(tmp_path, OWN_FAMILY + "production: {edge_shift_nm: 2}\n")
