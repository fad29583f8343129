"""Every file of a finished run is guarded: damage is named, is not read, and the same command mends it alone."""

from __future__ import annotations

import hashlib
import itertools
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import chdir
from functools import cache
from pathlib import Path

import pytest

from sweep.base.errors import OutputError
from sweep.results.inventory import Inventory
from sweep.run import output_folder, run_study
from sweep.study import load_study

from ..build import stopband_study
from ..commanded import commanded
from ..conftest import draw_nothing
from ..warm import Warm

GRID = "{left_nm: [590, 600, 610], left_width_nm: 5, right_nm: {min: 640, max: 690, count: 51}, right_width_nm: 5}"
LIMITS = "constraints:\n  sensitivity: {min: 0.9}\n"
PUBLISHED = "published:\n  Table 2:\n    RGGB: {csd_yellow_red: 138}\n"
EVERY_TABLE = stopband_study(
    "small",
    GRID,
    before="""\
scenarios:
  chart: {exposure: {kind: white_patch}, noise: true}
pixel: {read_noise_e: 2}
""",
    after=f"""\
{LIMITS}search: {{starts: 1, max_evaluations: 20, front: {{min: 0.8, max: 0.9, count: 2}}}}
recognition: {{states: [green, yellow, red], patches: 20}}
{PUBLISHED}""",
)
FEW_PICTURES = stopband_study("small", GRID, after=LIMITS + PUBLISHED)
"""Pictures that are compared are drawn, which takes seconds; elsewhere a word stands in their place."""
LISTS = ("run.json", "SHA256SUMS")
READ = (
    *("results.parquet", "search.parquet", "front.parquet", "curves.parquet", "points.parquet", "recognition.parquet"),
    *("audit.parquet", "study.resolved.yaml", "provenance.json"),
)
PICTURED = ("report.html", "pareto.png", "figures/sensor.svg")
DRAWN = (*PICTURED, "paper_comparison.csv", "paper_comparison.parquet")


def deleted(path: Path) -> None:
    path.unlink()


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def flipped(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 1
    path.write_bytes(content)


def garbled(path: Path) -> None:
    path.write_bytes(hashlib.shake_128(path.name.encode()).digest(path.stat().st_size))


def a_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def a_link(path: Path) -> None:
    """To a copy that is whole, which is not the run's."""
    elsewhere = Path(f"elsewhere-{path.name}").absolute()
    path.rename(elsewhere)
    path.symlink_to(elsewhere)


DAMAGES = (deleted, cut, flipped, garbled, a_folder, a_link)
FEW = {
    ("results.parquet", flipped),
    ("provenance.json", deleted),
    ("SHA256SUMS", a_link),
}


def cases() -> list[object]:
    every = [*itertools.product((*LISTS, *READ, *DRAWN[1:]), DAMAGES), *itertools.product(DRAWN[:1], DAMAGES[::2])]
    return [
        pytest.param(
            file, damage, marks=() if (file, damage) in FEW else pytest.mark.slow, id=f"{file}-{damage.__name__}"
        )
        for file, damage in every
    ]


def drawing(*arguments: object) -> int:
    """Exit code of a command in a process of its own that draws pictures."""
    return Warm(*arguments, said=Path("said").absolute(), drawn=True).wait(timeout=300)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Callable[[bool], Path]:
    """Whether pictures are drawn -> a folder with a study and its finished run."""

    @cache
    def base_of(drawn: bool) -> Path:
        base, folder = tmp_path_factory.mktemp("finished"), Path("outputs/small")
        (base / "small.yaml").write_text(FEW_PICTURES if drawn else EVERY_TABLE)
        with chdir(base), pytest.MonkeyPatch.context() as patch:  # the report names the folder as the command does
            draw_nothing(patch)
            run_study(load_study(Path("small.yaml")), folder, 1, lambda *_: None, ["sweep", "run"])
            assert commanded("audit", folder)[0] == 0
            assert (drawing("report", folder) if drawn else commanded("report", folder)[0]) == 0
            made = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
            assert made >= {*LISTS, *DRAWN, *(() if drawn else READ)}
            assert made - {".lock", *LISTS} == Inventory(folder).files.keys()
        return base

    return base_of


@pytest.fixture
def study() -> Path:
    """In the folder of the test, as that of the run is."""
    return Path("small.yaml").absolute()


@pytest.fixture
def folder(
    request: pytest.FixtureRequest,
    finished: Callable[[bool], Path],
    tmp_path: Path,
    plain_pictures: None,  # noqa: ARG001  (in this process)
) -> Iterator[Path]:
    case = getattr(request.node, "callspec", None)
    shutil.copytree(finished(case is not None and case.params["file"] in PICTURED), tmp_path, dirs_exist_ok=True)
    with chdir(tmp_path):
        yield Path("outputs/small")


def state(folder: Path) -> dict[str, tuple[int, str]]:
    """Time and digest of every file but the lock."""
    return {
        path.relative_to(folder).as_posix(): (path.stat().st_mtime_ns, hashlib.sha256(path.read_bytes()).hexdigest())
        for path in folder.rglob("*")
        if path.is_file() and path.name != ".lock"
    }


def named_in(said: str, folder: Path) -> list[str]:
    """Files that a command refuses, one a line."""
    return [line.removeprefix(f"sweep: {folder}/").split(": ")[0] for line in said.splitlines()]


@pytest.mark.parametrize(("file", "damage"), cases())
def test_a_damage_is_named_and_mended_alone(
    folder: Path, study: Path, file: str, damage: Callable[[Path], None]
) -> None:
    before = state(folder)
    damage(folder / file)
    code, _, said = commanded("status", folder, "--verify")
    assert (code, named_in(said, folder)) == (2, [file])
    if file in READ:
        for command in (
            ("report", folder),
            ("export", folder, "--design", "best"),
            ("compare", folder, folder, "--output", folder.parent / "to"),
            *([("audit", folder)] if file != "audit.parquet" else []),
        ):
            code, out, said = commanded(*command)
            assert (code, out, named_in(said, folder)) == (2, "", [file]), command
    again = ("run", study, "--output", folder.parent, "--jobs", 1)
    if file in PICTURED:  # pictures are the same from process to process, not from one drawing to the next in one
        assert drawing(*again) == 0
    else:
        assert commanded(*again)[0] == 0
    after = state(folder)
    assert {name: digest for name, (_, digest) in after.items()} == {n: digest for n, (_, digest) in before.items()}
    assert {name for name in after if after[name] != before[name]} == {file}
    code, out, _ = commanded("status", folder, "--verify")
    assert code == 0
    assert out.splitlines()[-1].startswith(f"ok: its {len(after)} files")
    elsewhere = Path(f"elsewhere-{Path(file).name}")
    assert not elsewhere.exists() or hashlib.sha256(elsewhere.read_bytes()).hexdigest() == before[file][1]


def test_the_lists_are_in_the_form_of_sha256sum(folder: Path) -> None:
    done = subprocess.run(["sha256sum", "--strict", "-c", "SHA256SUMS"], cwd=folder, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == len(state(folder)) - 1


def test_an_intact_run_is_not_touched_again(folder: Path, study: Path) -> None:
    before = state(folder)
    code, _, said = commanded("run", study, "--output", folder.parent, "--jobs", 1)
    assert code == 0
    assert "nothing was computed" in said
    assert state(folder) == before


def test_what_stands_in_a_file_s_place_is_not_removed(folder: Path, study: Path) -> None:
    (folder / "curves.parquet").unlink()
    (folder / "curves.parquet").mkdir()
    (folder / "curves.parquet" / "mine.txt").write_text("mine")
    code, _, said = commanded("run", study, "--output", folder.parent, "--jobs", 1)
    assert (code, named_in(said, folder)) == (2, ["curves.parquet"])
    assert (folder / "curves.parquet" / "mine.txt").read_text() == "mine"


def test_without_both_lists_nothing_is_replaced(folder: Path, study: Path) -> None:
    for name in LISTS:
        (folder / name).unlink()
    before = state(folder)
    loaded = load_study(study)
    beside, note = output_folder(folder, loaded)
    assert beside == folder.with_name("small-2")
    assert note is not None
    with pytest.raises(OutputError, match="is not of this run"):
        run_study(loaded, folder, 1, lambda *_: pytest.fail("something was computed"))
    for command in (("status", folder), ("export", folder, "--design", "best")):
        code, _, said = commanded(*command)
        assert code == 2
        assert "its run.json and SHA256SUMS are both missing or damaged" in said
    assert state(folder) == before
