"""What an installed package offers by entry points: asked for by name, loaded only where that is allowed."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest
from joblib.externals.loky import get_reusable_executor

from sweep.errors import StudyError
from sweep.report import read_output
from sweep.run import run_study
from sweep.study import Study, load_study

from ..commanded import commanded
from .test_own_family import OWN as OWN_FAMILY
from .test_own_family import STOPBAND
from .test_own_metric import CODE, rows_of

OFFERS = """\
[sweep.families]
band = cfa_extras.filters:Band
[sweep.metrics]
spread = cfa_extras.metrics:Spread
"""
STUDY = OWN_FAMILY.replace("filters.py:Band", "band").replace("search:\n  space: edges\n", "metrics: [spread]\n")


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A package as pip leaves it, in a folder of its own; it says when it runs."""
    root = tmp_path / "site"
    own = root / "cfa_extras"
    own.mkdir(parents=True)
    (own / "__init__.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w').close()\n")
    (own / "filters.py").write_text(STOPBAND)
    (own / "metrics.py").write_text(CODE)
    found = root / "cfa_extras-1.2.dist-info"
    found.mkdir()
    (found / "METADATA").write_text("Metadata-Version: 2.1\nName: cfa-extras\nVersion: 1.2\n")
    (found / "entry_points.txt").write_text(OFFERS)
    monkeypatch.syspath_prepend(str(root))
    monkeypatch.setattr("sweep.own_code._begun", {})
    monkeypatch.setenv("PYTHONPATH", str(root))  # for worker processes, which are started anew
    get_reusable_executor().shutdown()
    yield own
    for name in [name for name in sys.modules if name.partition(".")[0] == "cfa_extras"]:
        del sys.modules[name]


def study(folder: Path, text: str = STUDY, *, allow: bool = True) -> Study:
    path = folder / "named.yaml"
    path.write_text(text)
    return load_study(path, allow_code=allow)


def test_a_family_and_a_metric_of_a_package_are_like_those_of_files(package: Path, tmp_path: Path) -> None:
    made = study(tmp_path)
    run_study(made, tmp_path / "named", 2, lambda *_: None)
    (tmp_path / "filters.py").write_text(STOPBAND)
    (tmp_path / "mine.py").write_text(CODE)
    of_files = study(
        tmp_path, STUDY.replace("family: band", "family: filters.py:Band").replace("spread", "mine.py:Spread")
    )
    run_study(of_files, tmp_path / "files", 1, lambda *_: None)
    pd.testing.assert_frame_equal(
        rows_of(tmp_path / "named").drop(columns="family"), rows_of(tmp_path / "files").drop(columns="family")
    )
    kept = read_output(tmp_path / "named").provenance.data_sha256
    assert sorted(kept) == [
        "code of cfa-extras 1.2 (sweep.families: band)",
        "code of cfa-extras 1.2 (sweep.metrics: spread)",
    ]
    assert commanded("audit", tmp_path / "named")[0] == 2
    assert commanded("audit", tmp_path / "named", "--allow-code")[0] == 0
    (package / "filters.py").write_text(STOPBAND + "# other\n")
    code, _, said = commanded("audit", tmp_path / "named", "--allow-code")
    assert code == 2
    assert "not the code that the run had (got 'code of cfa-extras 1.2" in said


@pytest.mark.usefixtures("package")
def test_nothing_of_a_package_runs_unasked(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="what an installed package offers, whose code would run") as caught:
        study(tmp_path, allow=False)
    assert len(caught.value.faults) == 1
    assert commanded("run", tmp_path / "named.yaml")[0] == 2
    assert not (tmp_path / "ran").exists()
    with pytest.raises(StudyError, match=r"unknown family \(got 'bands'\).*stopband, band; did you mean 'band'"):
        study(tmp_path, STUDY.replace("family: band", "family: bands").replace("metrics: [spread]\n", ""))
    assert not (tmp_path / "ran").exists()
    study(tmp_path)
    assert (tmp_path / "ran").exists()


@pytest.mark.parametrize(
    ("file", "text", "said"),
    [
        ("filters.py", "import nothing_like_it\n", "band cannot be loaded: ModuleNotFoundError"),
        ("filters.py", "Bend = 1\n", "band cannot be loaded: AttributeError"),
        ("metrics.py", "Spread = 3\n", "spread: TypeError: 'int' object is not callable"),
    ],
)
def test_faults_of_a_package_are_lines(package: Path, tmp_path: Path, file: str, text: str, said: str) -> None:
    (package / file).write_text(text)
    with pytest.raises(StudyError) as caught:
        study(tmp_path)
    assert said in str(caught.value)
    assert len(caught.value.faults) == 1


def test_code_that_changed_since_it_was_loaded_is_told(package: Path, tmp_path: Path) -> None:
    study(tmp_path)
    (package / "metrics.py").write_text(CODE + "# other\n")
    with pytest.raises(StudyError, match=r"the code of cfa-extras 1.2 is not that with which .* a new process"):
        study(tmp_path)


def test_two_packages_with_one_name_are_told(package: Path, tmp_path: Path) -> None:
    other = package.parent / "other-3.0.dist-info"
    other.mkdir()
    (other / "METADATA").write_text("Metadata-Version: 2.1\nName: other\nVersion: 3.0\n")
    (other / "entry_points.txt").write_text("[sweep.families]\nband = other:Band\n")
    with pytest.raises(StudyError, match=r"cfa-extras 1.2 and other 3.0 both offer it \(got 'band'\)"):
        study(tmp_path)
