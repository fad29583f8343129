"""Folders of interrupted runs that someone else made: continued, they run nothing and stay within themselves."""

from __future__ import annotations

import hashlib
import json
import os
import pickle
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

from sweep.base.errors import OutputError
from sweep.commands.status import status_lines
from sweep.results.inventory import Inventory
from sweep.results.journal import SHARDS, Entry, Journal
from sweep.results.records import to_json
from sweep.results.tables import encoded
from sweep.run import output_folder, run_study
from sweep.search.problem import Evaluation, SearchRun
from sweep.study import Study, load_study

from ..build import study_file
from ..cases import thinned
from ..mischief import StoppedError, rows
from ..tampering import hostile

JOURNAL = f"{SHARDS}/_journal.jsonl"
Attack = Callable[[Path, Path], None]
"""Changes a folder; the second path is outside of it."""
seen: list[tuple[str, tuple[Any, ...]]] | None = None


def watch(event: str, details: tuple[Any, ...]) -> None:
    if seen is None or event not in ("open", "os.remove", "os.rename", "os.rmdir", "pickle.find_class", "os.system"):
        return
    if event == "open" and isinstance(details[0], str | bytes) and not (details[2] or 0) & os.O_NOFOLLOW:
        details = (os.path.realpath(details[0]), *details[1:])  # where a link leads to
    seen.append((event, details))


@cache
def watch_from_now_on() -> None:
    """Not before: a hook cannot be taken back, and each event of every later test would go through it."""
    sys.addaudithook(watch)


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    path = study_file(tmp_path_factory.mktemp("study"), 2)
    text = (
        path.read_text()
        .replace("count: 51", "count: 2")
        .replace("starts: 4, max_evaluations: 200", "starts: 2, max_evaluations: 12")
    )
    path.write_text(text.replace("  dim: {exposure: {kind: fixed, exposure_s: 0.002}}\n", ""))
    return load_study(path)


def quiet(*_: object) -> None:
    pass


@pytest.fixture(scope="module")
def expected(study: Study, tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    folder = tmp_path_factory.mktemp("expected")
    run_study(study, folder, 1, quiet)
    return rows(folder)


@pytest.fixture(scope="module")
def interrupted(study: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("interrupted")

    def stop(phase: str, done: int, _: int) -> None:
        if phase == "designs" and done >= 3:
            raise StoppedError

    with pytest.raises(StoppedError):
        run_study(study, folder, 1, stop)
    kinds = {Path(entry.file).suffix for entry in Journal(folder).entries.values()}
    assert kinds == {".json", ".parquet"}
    return folder


def entries(folder: Path, suffix: str) -> list[Entry]:
    return [entry for entry in Journal(folder).entries.values() if entry.file.endswith(suffix)]


def say(folder: Path, *lines: object) -> None:
    """Lines at the end of the journal."""
    with (folder / JOURNAL).open("ab") as journal:
        for line in lines:
            journal.write((line if isinstance(line, bytes) else json.dumps(line).encode()) + b"\n")


def planted(folder: Path, entry: Entry, content: bytes, file: str | None = None, **lies: object) -> None:
    """A file with its digest in the journal."""
    name = file or entry.file
    (folder / SHARDS / name).write_bytes(content)
    honest = {"file": name, "sha256": hashlib.sha256(content).hexdigest(), "size": len(content)}
    say(folder, asdict(entry) | honest | lies)


class Bomb:
    def __reduce__(self) -> tuple[Any, ...]:
        return os.system, ("touch ran-something",)


def old_pickles(folder: Path, _: Path) -> None:
    for entry in entries(folder, ".json"):
        planted(folder, entry, pickle.dumps(Bomb()), f"_answer-{entry.key[:16]}.pickle")


def new_pickles(folder: Path, _: Path) -> None:
    for entry in entries(folder, ".json"):
        planted(folder, entry, pickle.dumps(Bomb()))


def pickled_shards(folder: Path, _: Path) -> None:
    for entry in entries(folder, ".parquet"):
        planted(folder, entry, pickle.dumps(Bomb()))


def wrong_answers(folder: Path, _: Path) -> None:
    for entry, content in zip(entries(folder, ".json"), hostile()[4:6], strict=False):
        planted(folder, entry, content)


def answers_of_other_problems(folder: Path, _: Path) -> None:
    one, two = entries(folder, ".json")[:2]
    planted(folder, one, to_json(SearchRun(0, "success", [Evaluation(np.ones(3), 1e9, 1.0, 1.0, 0.0)])))
    planted(folder, two, to_json(SearchRun(1, "success", [Evaluation(np.full(5, np.nan), 1e9, 1.0, 1.0, 0.0)])))


def no_evaluations(folder: Path, _: Path) -> None:
    for entry in entries(folder, ".json"):
        planted(folder, entry, to_json(SearchRun(0)))


def other_places(folder: Path, outside: Path) -> None:
    for entry in Journal(folder).entries.values():
        for file in (
            *(
                "../../outside/precious.txt",
                str(outside / "precious.txt"),
                "..",
                ".",
                "",
                "a/b",
                "_journal.jsonl",
                "\0",
            ),
            *("../run.json", f"../{SHARDS}/{entry.file}", f"./{entry.file}", entry.file + "\n"),
        ):
            content = (outside / "precious.txt").read_bytes()
            digest = hashlib.sha256(content).hexdigest()
            say(folder, asdict(entry) | {"file": file, "sha256": digest, "size": len(content)})


def lies(folder: Path, _: Path) -> None:
    for entry in Journal(folder).entries.values():
        for lie in (
            *({"size": size} for size in (-1, 0, 1, 2**30, 2**62, 1.5, "9", None, True, 10**400)),
            *({"rows": count} for count in (-1, 10**18, "9", None, 1e400)),
            *({"failed": count} for count in (-1, 10**18, [])),
            *({"seconds": time, "at": time} for time in (float("nan"), float("inf"), "9", 10**400)),
            *({"key": key} for key in ("", "x", 5, None, {}, entry.key.upper() + "0", "\ud800")),
            {"sha256": 5},
            {"more": 1},
        ):
            say(folder, asdict(entry) | lie)


def right_sizes_of_wrong_rows(folder: Path, _: Path) -> None:
    for entry in entries(folder, ".parquet"):
        say(folder, asdict(entry) | {"rows": entry.rows + 5})


def no_lines(folder: Path, _: Path) -> None:
    say(
        folder,
        b"\xff\xfe" * 100,
        b"[" * 200_000,
        b'{"a":' * 50_000,
        b"null",
        b"5",
        b'"x"',
        b"[]",
        b"{}",
        b"NaN",
        b"1" * 9999,
    )
    say(folder, b"x" * 5_000_000)


def other_tables(folder: Path, _: Path) -> None:
    found = entries(folder, ".parquet")
    table = pa.table({"design_id": [1]})
    planted(folder, found[0], encoded(table), rows=1)
    real = Journal(folder)
    schema_of = pa.parquet.read_table(folder / SHARDS / found[1].file)
    planted(folder, found[1], encoded(pa.concat_tables([schema_of] * 3)), rows=3 * found[1].rows)
    content = bytearray((folder / SHARDS / found[2].file).read_bytes())
    content[len(content) // 3] ^= 1
    planted(folder, found[2], bytes(content))
    assert real.entries


def links(folder: Path, outside: Path) -> None:
    for entry in Journal(folder).entries.values():
        path = folder / SHARDS / entry.file
        path.unlink()
        path.symlink_to(outside / "precious.txt")


def a_journal_elsewhere(folder: Path, outside: Path) -> None:
    (folder / JOURNAL).unlink()
    (folder / JOURNAL).symlink_to(outside / "precious.txt")


def lists_elsewhere(folder: Path, outside: Path) -> None:
    for name in ("run.json", "SHA256SUMS"):
        (folder / name).unlink()
        (folder / name).symlink_to(outside / "precious.txt")


def pipes(folder: Path, _: Path) -> None:
    for entry in Journal(folder).entries.values():
        path = folder / SHARDS / entry.file
        path.unlink()
        os.mkfifo(path)


def a_pipe_for_a_journal(folder: Path, _: Path) -> None:
    (folder / JOURNAL).unlink()
    os.mkfifo(folder / JOURNAL)


def pipes_for_lists(folder: Path, _: Path) -> None:
    for name in ("run.json", "SHA256SUMS"):
        (folder / name).unlink()
        os.mkfifo(folder / name)


def foreign_names_in_run_json(folder: Path, outside: Path) -> None:
    inventory = Inventory(folder)
    save = inventory.save
    digest = hashlib.sha256((outside / "precious.txt").read_bytes()).hexdigest()
    names = ("../../outside/precious.txt", str(outside / "precious.txt"), "figures/../../x.png", "mine.txt", ".lock")
    (folder / "mine.txt").write_text("mine")
    inventory.files |= {name: replace(_digest(), sha256=digest) for name in names}
    save()


def _digest() -> Any:
    from sweep.base.disk import Digest

    return Digest("0" * 64, 8)


def strange_facts(folder: Path, _: Path) -> None:
    inventory = Inventory(folder)
    inventory.facts |= {"designs": "many", "identity": [1], "workers": {}, "duration_s": 1e308, "command": 5}
    inventory.save()


def foreign_names_in_sums(folder: Path, outside: Path) -> None:
    (folder / "run.json").unlink()
    digest = hashlib.sha256((outside / "precious.txt").read_bytes()).hexdigest()
    with (folder / "SHA256SUMS").open("a") as sums:
        sums.write(f"{digest}  ../../outside/precious.txt\n{digest}  {outside}/precious.txt\n{digest}  mine.txt\n\xff")


def sparse(folder: Path, _: Path) -> None:
    """Files of a terabyte that take no room."""
    for entry in Journal(folder).entries.values():
        os.truncate(folder / SHARDS / entry.file, 2**40)
        say(folder, asdict(entry) | {"size": 2**40})


def a_sparse_journal(folder: Path, _: Path) -> None:
    os.truncate(folder / JOURNAL, 2**40)


def sparse_lists(folder: Path, _: Path) -> None:
    for name in ("run.json", "SHA256SUMS"):
        os.truncate(folder / name, 2**40)


def a_shards_link(folder: Path, outside: Path) -> None:
    (folder / SHARDS).rename(folder.parent / "shards-elsewhere")
    (folder / SHARDS).symlink_to(outside)


def a_figures_link(folder: Path, outside: Path) -> None:
    (folder / "figures").symlink_to(outside)


def a_lock_link(folder: Path, outside: Path) -> None:
    (folder / ".lock").unlink()
    (folder / ".lock").symlink_to(outside / "precious.txt")


CONTINUED: dict[str, tuple[Attack, ...]] = {
    "answers": (old_pickles, pickled_shards, wrong_answers),
    "journal": (other_places, lies, no_lines),
    "tables": (other_tables, answers_of_other_problems, foreign_names_in_run_json),
    "links": (links, strange_facts),
    "pipes": (pipes, foreign_names_in_sums),
    "sizes": (sparse, right_sizes_of_wrong_rows),
    "journal elsewhere": (a_journal_elsewhere,),
}
"""Attacks after which the same command gives the right rows."""
REFUSED = (
    a_shards_link,
    a_figures_link,
    a_lock_link,
    lists_elsewhere,
    pipes_for_lists,
    sparse_lists,
    a_pipe_for_a_journal,
)
"""Attacks that a line tells."""
ALONE = (new_pickles, no_evaluations, a_sparse_journal, *(attack for some in CONTINUED.values() for attack in some))


def attacked(interrupted: Path, tmp_path: Path, *attacks: Attack) -> tuple[Path, dict[str, bytes]]:
    import shutil

    folder, outside = tmp_path / "in" / "tiny", tmp_path / "outside"
    shutil.copytree(interrupted, folder)
    outside.mkdir()
    (outside / "precious.txt").write_text("precious")
    (outside / "00000001-0123456789abcdef.parquet").write_text("precious, too")
    for attack in attacks:
        attack(folder, outside)
    return folder, {path.name: path.read_bytes() for path in outside.iterdir()}


def watched(run: Callable[[], object]) -> list[tuple[str, tuple[Any, ...]]]:
    global seen  # noqa: PLW0603  (an audit hook cannot be taken back)
    watch_from_now_on()
    seen = []
    try:
        run()
    finally:
        found, seen = seen, None
    return found


def check_outside(folder: Path, held: dict[str, bytes], events: list[tuple[str, tuple[Any, ...]]]) -> None:
    outside = folder.parents[1] / "outside"
    assert {path.name: path.read_bytes() for path in outside.iterdir()} == held
    assert not [event for event in events if event[0] in ("pickle.find_class", "os.system")]
    for event, details in events:
        path = os.fsdecode(details[0]) if isinstance(details[0], str | bytes) else ""
        assert not path.startswith(str(outside)), (event, path)


def ways(*groups: tuple[Attack, ...]) -> Iterator[Any]:
    for attacks in groups:
        yield pytest.param(attacks, id="-".join(attack.__name__ for attack in attacks))


@pytest.mark.parametrize(
    "attacks",
    [
        *thinned(ways(*CONTINUED.values()), 3),
        *(pytest.param((attack,), id=f"{attack.__name__}-alone", marks=pytest.mark.slow) for attack in ALONE),
    ],
)
def test_a_hostile_folder_gives_the_right_rows(
    study: Study,
    expected: pd.DataFrame,
    interrupted: Path,
    tmp_path: Path,
    attacks: tuple[Attack, ...],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    folder, held = attacked(interrupted, tmp_path, *attacks)
    events = watched(lambda: status_lines(folder))
    events += watched(lambda: run_study(study, folder, 1, quiet))
    check_outside(folder, held, events)
    assert not (tmp_path / "ran-something").exists()
    pd.testing.assert_frame_equal(rows(folder), expected)
    if (folder / "mine.txt").exists():
        assert (folder / "mine.txt").read_text() == "mine"
    assert status_lines(folder, verify=True)[-1].startswith("ok")


@pytest.mark.parametrize("attack", [other_places, no_lines])
def test_lines_that_no_journal_writes_are_no_entries(interrupted: Path, tmp_path: Path, attack: Attack) -> None:
    folder, _ = attacked(interrupted, tmp_path, attack)
    assert Journal(folder).entries == Journal(interrupted).entries


@pytest.mark.parametrize("attack", REFUSED)
def test_a_hostile_folder_is_told_in_a_line(study: Study, interrupted: Path, tmp_path: Path, attack: Attack) -> None:
    folder, held = attacked(interrupted, tmp_path, attack)

    def refused() -> None:
        with pytest.raises(OutputError) as caught:
            run_study(study, folder, 1, quiet)
        assert len(caught.value.faults) == 1

    check_outside(folder, held, watched(refused))
    output_folder(folder, study)


@pytest.mark.slow
def test_hundreds_of_damaged_journals_and_shards(
    study: Study, expected: pd.DataFrame, interrupted: Path, tmp_path: Path
) -> None:
    """Random bytes changed, cut or put in anywhere; each twentieth folder is continued to its end."""
    import shutil

    rng = np.random.default_rng(29)
    for number in range(400):
        folder = tmp_path / str(number)
        shutil.copytree(interrupted, folder)
        files = sorted(path for path in folder.rglob("*") if path.is_file() and path.name != ".lock")
        for path in rng.choice(np.array(files, dtype=object), size=int(rng.integers(1, 4)), replace=False):
            content = bytearray(path.read_bytes())
            at = int(rng.integers(len(content) + 1))
            wish = rng.integers(4)
            if wish == 0 and at < len(content):
                content[at] ^= 1 << int(rng.integers(8))
            elif wish == 1:
                del content[at:]
            elif wish == 2:
                content[at:at] = rng.bytes(int(rng.integers(1, 200)))
            else:
                content[at : at + 50] = b""
            path.write_bytes(bytes(content))
        both = not Inventory(folder).fingerprint
        journal = Journal(folder)
        journal.check()
        for key in list(journal.entries):
            journal.content(key)
        if number % 20 == 0:
            if both:  # neither list is whole: nothing of it is this run's
                with pytest.raises(OutputError):
                    run_study(study, folder, 1, quiet)
            else:
                run_study(study, folder, 1, quiet)
                pd.testing.assert_frame_equal(rows(folder), expected)
        shutil.rmtree(folder)
