"""What an installed package offers by entry points: asked for by name, loaded only where that is allowed."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from joblib.externals.loky import get_reusable_executor

from sweep.base.errors import StudyError
from sweep.report import read_output
from sweep.runs import run_study
from sweep.study import Study, load_study

from ..build import one_line
from ..cases import thinned
from ..commanded import commanded
from ..mischief import rows as rows_in
from .own_codes import CODE, OWN_FAMILY, STOPBAND

OFFERS = """\
[sweep.families]
band = cfa_extras.filters:Band
[sweep.metrics]
spread = cfa_extras.metrics:Spread
[sweep.sensors]
mine = cfa_extras.curves:SENSOR
[sweep.lights]
leds = cfa_extras.curves:leds
"""
CURVES = """\
SENSOR = {"files": [{"file": "qe.csv", "columns": {"R": "R", "G": "G", "B": "B", "Y": "Y"}}], "clear": "Y"}


def leds():
    return {"files": [{"file": "leds.csv", "quantity": "photons", "signals": {"yellow": ["amber"], "red": ["ruby"]}}]}
"""
NM = np.arange(400, 701)
MIDDLES = {"R": 630, "G": 540, "B": 460}
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
    (own / "curves.py").write_text(CURVES)
    table = pd.DataFrame({name: 0.8 * np.exp(-(((NM - at) / 40) ** 2)) for name, at in MIDDLES.items()}, index=NM)
    table.assign(Y=table.G + table.R).rename_axis("nm").to_csv(own / "qe.csv")
    leds = {name: np.exp(-(((NM - at) / 12) ** 2)) for name, at in (("amber", 592), ("ruby", 636))}
    pd.DataFrame(leds, index=NM).rename_axis("nm").to_csv(own / "leds.csv")
    found = root / "cfa_extras-1.2.dist-info"
    found.mkdir()
    (found / "METADATA").write_text("Metadata-Version: 2.1\nName: cfa-extras\nVersion: 1.2\n")
    (found / "entry_points.txt").write_text(OFFERS)
    monkeypatch.syspath_prepend(str(root))
    monkeypatch.setattr("sweep.base.user_code._begun", {})
    monkeypatch.setenv("PYTHONPATH", str(root))  # for worker processes, which are started anew
    get_reusable_executor().shutdown()
    yield own
    for name in [name for name in sys.modules if name.partition(".")[0] == "cfa_extras"]:
        del sys.modules[name]


def study(folder: Path, text: str = STUDY, *, allow: bool = True) -> Study:
    path = folder / "named.yaml"
    path.write_text(text)
    return load_study(path, allow_code=allow)


@pytest.mark.parametrize("jobs", thinned([1, 2]))
def test_a_family_and_a_metric_of_a_package_are_like_those_of_files(package: Path, tmp_path: Path, jobs: int) -> None:
    made = study(tmp_path)
    run_study(made, tmp_path / "named", jobs, lambda *_: None)
    (tmp_path / "filters.py").write_text(STOPBAND)
    (tmp_path / "mine.py").write_text(CODE)
    of_files = study(
        tmp_path, STUDY.replace("family: band", "family: filters.py:Band").replace("spread", "mine.py:Spread")
    )
    run_study(of_files, tmp_path / "files", 1, lambda *_: None)
    pd.testing.assert_frame_equal(
        rows_in(tmp_path / "named").drop(columns="family"), rows_in(tmp_path / "files").drop(columns="family")
    )
    assert commanded("audit", tmp_path / "named")[0] == 2
    assert commanded("audit", tmp_path / "named", "--allow-code")[0] == 0
    (package / "filters.py").write_text(STOPBAND + "# other\n")
    code, _, said = commanded("audit", tmp_path / "named", "--allow-code")
    assert (code, "not the code that the run had" in said) == (2, True)


@pytest.mark.usefixtures("package")
def test_no_code_of_a_package_runs_without_allow_code(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="a plugin of an installed package, whose code would run") as caught:
        study(tmp_path, allow=False)
    assert len(caught.value.issues) == 2  # the family and the metric
    assert commanded("run", tmp_path / "named.yaml")[0] == 2
    assert not (tmp_path / "ran").exists()
    study(tmp_path)
    assert (tmp_path / "ran").exists()


def test_code_changed_after_loading_is_reported(package: Path, tmp_path: Path) -> None:
    study(tmp_path)
    (package / "metrics.py").write_text(CODE + "# other\n")
    with pytest.raises(StudyError, match=r"the code of cfa-extras 1.2 is not that with which .* a new process"):
        study(tmp_path)


PACKED = """\
study: packed
sensor: mine
lights: leds
cfas: [RGGB, RYYB]
"""


def test_curves_of_a_package_are_those_of_its_files(package: Path, tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="a plugin of an installed package, whose code would run"):
        study(tmp_path, PACKED, allow=False)
    assert not (tmp_path / "ran").exists()
    made = study(tmp_path, PACKED)
    table = pd.read_csv(package / "qe.csv", index_col="nm")
    np.testing.assert_allclose(made.sensor.qe["R"], table["R"].to_numpy())
    assert (made.sensor.clear, made.sensor.name, made.lights.classes) == ("Y", "mine", ("yellow", "red"))
    run_study(made, tmp_path / "packed", 1, lambda *_: None)
    kept = read_output(tmp_path / "packed").provenance
    assert {"qe.csv", "leds.csv", "code of cfa-extras 1.2 (sweep.sensors: mine)"} <= kept.data_sha256.keys()


@pytest.mark.parametrize(
    ("file", "text", "said"),
    [
        ("filters.py", "import nothing_like_it\n", "band cannot be loaded: ModuleNotFoundError"),
        ("filters.py", "Bend = 1\n", "band cannot be loaded: AttributeError"),
        ("metrics.py", "Spread = 3\n", "spread: TypeError: 'int' object is not callable"),
        ("curves.py", CURVES.replace("SENSOR =", "SENSOR = 3 or"), "mine says nothing of curves"),
        ("curves.py", CURVES.replace("    return", "    return 1 / 0 or"), "leds: ZeroDivisionError"),
        ("curves.py", CURVES.replace("leds.csv", "led.csv"), "no such file (got 'led.csv')"),
    ],
)
def test_faults_of_a_package_are_lines(package: Path, tmp_path: Path, file: str, text: str, said: str) -> None:
    (package / file).write_text(text)
    with one_line(said):
        study(tmp_path, PACKED if file == "curves.py" else STUDY)


def test_two_packages_with_one_plugin_name_are_reported(package: Path, tmp_path: Path) -> None:
    other = package.parent / "other-3.0.dist-info"
    other.mkdir()
    (other / "METADATA").write_text("Metadata-Version: 2.1\nName: other\nVersion: 3.0\n")
    (other / "entry_points.txt").write_text("[sweep.families]\nband = other:Band\n")
    with pytest.raises(StudyError, match=r"cfa-extras 1.2 and other 3.0 both offer it \(got 'band'\)"):
        study(tmp_path)
