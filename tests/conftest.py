"""Shared by the tests."""

from __future__ import annotations

import fcntl
import os
import resource
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from _pytest.terminal import TerminalReporter

from .shapes import check_types

ROOT = Path(__file__).parent.parent
UNCHECKED = ("kernels.py", "user_effects.py", "app.py", "__init__.py")
"""How names of files end that are left out: Numba compiles no function that is wrapped, effects of users are checked
by the package itself, and typer hands over a context of another class."""
if "UNCHECKED_TYPES" not in os.environ:  # of tests that take long
    check_types(
        {
            ".".join(path.relative_to(ROOT).with_suffix("").parts)
            for path in (ROOT / "sweep").rglob("*.py")
            if not path.name.endswith(UNCHECKED) and path.parent.name != "commands"
        }
    )

from sweep.features import FEATURES
from sweep.study import Study

from .commanded import commanded
from .hard.registry import write_table

STUDIES = ROOT / "studies"
MEASURED = ROOT / "sweep" / "spectra" / "builtin" / "measured"
"""Measured curves of the package."""
SHARED = ROOT.parent / "shared"

needs_measured = pytest.mark.skipif(
    not (SHARED / "data").is_dir(), reason="the measured curves (../shared/data) are not on this machine"
)


DEAR = frozenset((ROOT / "tests" / "dear.txt").read_text().splitlines())
"""Tests that take more than two seconds of a processor: left to `make slow`."""
DEAR_CPU_S = 3.0
"""With what a test is the first to import and compile; where more, it is named."""
MOST_CPU_S = 12.0
"""Of a quick test, on processors that are several times slower than ours or share their caches."""
SHARED_S: list[float] = []
"""Processor time of runs that tests share, which are of none of them."""
FEWER = {
    "stopband": {
        "starts: 16": "starts: 4",
        "front: {min: 0.80, max: 1.0, count: 21}": "front: {min: 0.80, max: 1.0, count: 4}",
    },
    "distance": {"[20, 40, 60, 80, 100, 125, 150, 175, 200, 225, 250, 275, 300]": "[20, 100, 300]"},
    "noise": {
        "[1, 2, 4, 8, 16, 32, 64, 128]": "[1, 8, 128]",
        "[0.95, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01]": "[0.95, 0.1, 0.01]",
        "[50, 100, 200, 400]": "[50, 400]",
        "[RGGB, RCCC, RCCB, RYYCy, RYNCy]": "[RGGB, RYYCy, RYNCy]",
    },
    "night": {"[1.0e-3, 2.0e-3, 3.0e-3, 4.0e-3, 5.0e-3, 6.0e-3, 8.0e-3, 1.1e-2]": "[1.0e-3, 4.0e-3, 1.1e-2]"},
    "exposure": {
        "1.0e-4, 1.5e-4, 2.0e-4, 2.5e-4, 3.0e-4, 3.5e-4, 4.0e-4, 5.0e-4, 6.0e-4, 8.0e-4, 1.0e-3, 1.5e-3, 2.0e-3, ": "3.0e-4, "
    },
    "angle": {"[0, 5, 10, 15, 20, 25, 30]": "[0, 15, 30]", "starts: 8": "starts: 2"},
    "producible": {"starts: 32": "starts: 4"},
    "freeform": {"starts: 4": "starts: 2"},
    "band": {
        "min: 600, max: 680, count: 21}": "min: 628, max: 644, count: 5}",
        "max: 80, count: 31}": "max: 46, count: 14}",
    },
    "dye": {"box: {absorbance_1": "box: {colorant_1: [20, 27], colorant_2: [20, 27], absorbance_1"},
    "dual": {"starts: 8": "starts: 2"},
    "rccb": {"front: {min: 0.80, max: 1.0, count: 11}": "front: {min: 0.80, max: 1.0, count: 3}"},
    "robust": {"max: 0.94, count: 3}": "max: 0.94, count: 2}"},
}
"""Scenes, starts or levels of a study of the project, and those of them that its finished run has: all take minutes."""
LOOKED_AT = ("stopband", "fog", "dual", "paper", "noise", "distance")
"""Studies whose reports tests open. The figures of the others are drawn, but no pictures made of them, which takes longer."""
FinishedFolder = Callable[[str], Path]
"""Name of a study of the project -> folder of its finished run."""
ROWS = pytest.StashKey[list[dict[str, Any]]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--hard-cases", metavar="PATH", help="write a table of the hard cases that ran to PATH, as JSON")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave dear tests to `make slow`. Of the part that a process tests first, the long ones come first.

    So at the end none waits for a long one of another.
    """
    for item in items:
        if item.nodeid in DEAR:
            item.add_marker(pytest.mark.slow)
    items[:] = [
        item for item in items if all(name in FEATURES for of in item.iter_markers("feature") for name in of.args)
    ]
    processes = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    kinds = [[item for item in items if (item.get_closest_marker("long") is None) is short] for short in (False, True)]
    ends = [[len(kind) * at // processes for at in range(processes + 1)] for kind in kinds]
    items[:] = [
        item
        for at in range(processes)
        for kind, end in zip(kinds, ends, strict=True)
        for item in kind[end[at] : end[at + 1]]
    ]


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """Fail a test of `make test` that takes far too much processor time."""
    began = _cpu_s() - sum(SHARED_S)
    result = yield
    used_s = _cpu_s() - sum(SHARED_S) - began
    if item.get_closest_marker("slow") is None and "UNLIMITED_CPU" not in os.environ:
        item.user_properties.append(("cpu_s", used_s))
        if used_s > MOST_CPU_S:
            pytest.fail(f"{used_s:.1f} s of a processor: more than {MOST_CPU_S:g} on any machine, see tests/dear.txt")
    return result


def pytest_terminal_summary(terminalreporter: TerminalReporter) -> None:
    """Name the tests of `make test` that take more than those of tests/dear.txt."""
    for report in terminalreporter.stats.get("passed", []):
        used_s = dict(report.user_properties).get("cpu_s", 0.0)
        if used_s > DEAR_CPU_S:
            terminalreporter.write_line(f"{used_s:.1f} s of a processor: {report.nodeid}, for tests/dear.txt?")


def _cpu_s() -> float:
    """Processor time of this process and of its children that ended, s."""
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def pytest_sessionfinish(session: pytest.Session) -> None:
    path, rows = session.config.getoption("--hard-cases"), session.config.stash.get(ROWS, [])
    if path and rows:
        write_table(Path(path), rows)


@pytest.fixture
def hard_case_rows(request: pytest.FixtureRequest) -> list[dict[str, Any]]:
    """Rows of the table of hard cases, one for each that ran in this session."""
    return request.config.stash.setdefault(ROWS, [])


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> FinishedFolder:
    """Runs of the project's studies by the command, each once; what it said is in `said.txt` beside the folder.

    Processes that test side by side share the runs.
    """
    base = tmp_path_factory.getbasetemp()
    outputs = (base if worker_id == "master" else base.parent) / "finished"
    outputs.mkdir(exist_ok=True)

    def folder_of(name: str) -> Path:
        said = outputs / f"{name}.said.txt"
        with (outputs / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not said.exists():
                text = (STUDIES / f"{name}.yaml").read_text()
                for every, fewer in FEWER.get(name, {}).items():
                    assert every in text
                    text = text.replace(every, fewer)
                study = outputs / f"{name}.yaml"
                study.write_text(text)
                began = _cpu_s()
                with pytest.MonkeyPatch.context() as patch:
                    if name not in LOOKED_AT:
                        without_pictures(patch)
                    code, out, err = commanded("run", study, "--output", outputs, "--jobs", 1)
                assert code == 0, err
                SHARED_S.append(_cpu_s() - began)
                said.write_text(out)
        return outputs / name

    return folder_of


@pytest.fixture(scope="session")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """A sweep alone, of two kinds of chunks."""
    from sweep.study import load_study

    from .build import study_file

    folder = tmp_path_factory.mktemp("study")
    path = study_file(folder)
    path.write_text(path.read_text().split("constraints:")[0])
    return load_study(path)


@pytest.fixture(scope="session")
def whole(plain: Study, tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    from .build import ran

    folder = tmp_path_factory.mktemp("whole")
    ran(plain, folder, 1)
    return pd.read_parquet(folder / "results.parquet")


def without_pictures(patch: pytest.MonkeyPatch) -> None:
    """Pages whose pictures are empty."""

    patch.setattr("sweep.report.page.svg", lambda *_: "<svg></svg>")
    for module in ("report.page", *(["features.sensors.page"] if "sensors" in FEATURES else [])):
        patch.setattr(
            f"sweep.{module}.pictures_of",
            lambda panels, name="pareto": {f"{name}.svg": b"svg", f"{name}.png": b"png"} if panels else {},
        )


def draw_nothing(patch: pytest.MonkeyPatch) -> None:
    """Reports and descriptions whose pictures take no time: for tests of the files and of the text."""
    without_pictures(patch)
    if "describe" in FEATURES:
        patch.setattr("sweep.features.describe.describe._png", lambda *_: b"sweep describe")


@pytest.fixture
def plain_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """See `draw_nothing`."""
    draw_nothing(monkeypatch)
