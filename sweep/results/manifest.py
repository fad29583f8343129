"""Manifest of a run's folder: which study it is of, and the digest of each of its files.

A folder without `manifest.json` is no run's: files in it that have names of a run's are others'.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import pyarrow as pa

from ..base.disk import digest_of, is_link, is_real_folder, read_facts
from ..base.errors import OutputError, ValidationIssue
from ..features import gathered
from ..study import SensorAndLights
from .atomic import write_bytes
from .dataset import part_paths, strange_entries
from .tables import (
    MANIFEST,
    PROVENANCE,
    RESULTS,
    is_drawn,
    is_of_run,
    json_of,
    made_by_run,
    read_table,
    write_table,
)

_MOST_BYTES = 2**32
"""No file of a run is larger."""
_MISSING, _DAMAGED, _STRANGE = "is missing", "is damaged", "is not of this run"
_DIGEST, _FILES = "digest", "files"


class Manifest:
    """The files of a run's folder, empty where there is no run.

    `files`: name (`report.html`) -> SHA-256 of the file; `facts`: `fingerprint` and `identity` of the study, and
    its number of designs; `damaged`: the manifest is there, but not as the run wrote it.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.facts = read_facts(folder / MANIFEST)
        digest = self.facts.pop(_DIGEST, None)
        self.damaged = os.path.lexists(folder / MANIFEST) and not (digest == _digest(self.facts) and self._is_whole())
        self.files: dict[str, str] = self.facts.pop(_FILES, {}) if not self.damaged else {}
        if self.damaged:
            self._read_without()

    def _is_whole(self) -> bool:
        """Return whether the facts have the types that a run writes."""
        files, runs = self.facts.get(_FILES), self.facts.get("runs", [])
        texts = [self.facts.get("fingerprint"), *(files.values() if isinstance(files, dict) else [None])]
        pairs = [pair if isinstance(pair, list) else [] for pair in (runs if isinstance(runs, list) else [None])]
        return all(isinstance(text, str) for text in texts) and all(
            [type(name) for name in pair] == [str, str] for pair in pairs
        )

    def _read_without(self) -> None:
        """Take the facts of a finished run from its provenance, and its files as they are."""
        known = read_facts(self.folder / PROVENANCE)
        self.facts = {key: known[key] for key in ("fingerprint", "runs", "designs") if key in known} | {_FILES: {}}
        if not self._is_whole():
            self.facts = {}
            return
        self.facts.pop(_FILES)
        for name in self._names_of_run():
            with suppress(OSError):
                self.files[name] = digest_of(self.path(name))

    @property
    def fingerprint(self) -> str:
        """Fingerprint of the run's study; empty without a run."""
        return str(self.facts.get("fingerprint", ""))

    def is_of(self, facts: Mapping[str, Any]) -> bool:
        """Return whether the folder holds the run with some facts."""
        return self.fingerprint == str(facts["fingerprint"])

    def require_run(self) -> None:
        """Raise OutputError if nothing tells which run the folder is of."""
        if self.damaged and not self.fingerprint:
            problem = "is damaged, so that nothing is known of the run; move its folder away"
            raise OutputError(ValidationIssue(problem, str(self.path(MANIFEST)), allowed="another --output"))
        if not self.fingerprint:
            made_by = read_facts(self.path(PROVENANCE)).get("versions", {})
            version = made_by.get("cfa-sweep") if isinstance(made_by, dict) else None
            problem = (
                "no run here" if version is None else f"a run of version {version} of sweep, which had no manifest"
            )
            raise OutputError(ValidationIssue(problem, str(self.folder), allowed="a folder that `sweep run` made"))

    @property
    def runs(self) -> list[SensorAndLights]:
        """Sensors and lights of a study of several; none of another."""
        pairs = self.facts.get("runs", [])
        return [SensorAndLights(sensor, lights, (at, at)) for at, (sensor, lights) in enumerate(pairs)]

    @property
    def finished(self) -> bool:
        """True if all files are there, provenance among them."""
        return PROVENANCE in self.files and not self.wrong(filter(_by_run, self.files), quick=True)

    @property
    def strange_rows(self) -> list[str]:
        """Entries that a reader takes for rows, and that the run did not write; a part of one that goes on may be."""
        begun = [] if PROVENANCE in self.files else [f"{RESULTS}/{path.name}" for path in part_paths(self.folder)]
        return strange_entries(self.folder, {*self.files, *begun})

    @property
    def notes(self) -> list[str]:
        """What a reader of the folder has to know, a line each."""
        lines = [
            f"{self.path(name)} {_STRANGE}, and readers of the folder take it for rows: move it away"
            for name in self.strange_rows
        ]
        if self.damaged:
            lines.append(f"{self.path(MANIFEST)} {_DAMAGED}; `sweep run` of the study writes it again")
        return lines

    def batches(self, columns: Sequence[str] | None = None) -> Iterator[pa.Table]:
        """Yield the rows of a run, a part at a time.

        `columns`: columns; left out, all of them. Raises OutputError if a part is missing or damaged.
        """
        for name in sorted(name for name in self.files if name.startswith(f"{RESULTS}/") and is_of_run(name)):
            self.require([name])
            yield read_table(self.path(name), columns)

    def path(self, name: str) -> Path:
        """Return the path of a file of the run."""
        return self.folder / name

    def wrong(self, names: Iterable[str] | None = None, *, quick: bool = False) -> dict[str, str]:
        """Return the files that differ from those of the run, and their issues.

        `names`: files that are looked at; left out, all; `quick`: only whether they are there.
        """
        issues = dict.fromkeys(self.strange_rows if names is None else (), _STRANGE)
        if names is None and self.damaged:
            issues[MANIFEST] = _DAMAGED
        for name in sorted(self.files if names is None else names):
            path = self.path(name)
            if name not in self.files or not os.path.lexists(path) or self._linked(name):
                issues[name] = _MISSING
            elif not quick:
                try:
                    damaged = path.stat().st_size > _MOST_BYTES or digest_of(path) != self.files[name]
                except OSError:
                    damaged = True
                if damaged:
                    issues[name] = _DAMAGED
        return issues

    def _linked(self, name: str) -> bool:
        """Return whether a link on the way to a file leads out of the folder."""
        return name.startswith(f"{RESULTS}/") and is_link(self.folder / RESULTS)

    def require(self, names: Iterable[str]) -> None:
        """Raise OutputError if a file is missing or damaged, with its name."""
        if wrong := self.wrong(names):
            raise OutputError(issues_of(self.folder, wrong))

    def foreign_files(self) -> list[str]:
        """Return the files of others under names that the run's commands give; none in the folder of a run."""
        if self.facts or self.damaged:
            return []
        return self._names_of_run()

    def _names_of_run(self) -> list[str]:
        inner = [f"{RESULTS}/{name}" for name in _names(self.folder / RESULTS)]
        return sorted(name for name in [*_names(self.folder), *inner] if is_of_run(name))

    def begin(self, facts: Mapping[str, Any]) -> None:
        """Write which study the folder is of.

        Raises OutputError if files of others are there, or the disk refuses.
        """
        for name in self.foreign_files():
            raise OutputError(ValidationIssue("file not created by sweep; move it", str(self.folder / name)))
        self.facts, self.damaged = dict(facts), False
        self.save()

    def write(self, contents: Mapping[str, bytes]) -> None:
        """Write files of the run and list them."""
        for name, content in contents.items():
            if self._linked(name):
                raise OutputError(ValidationIssue("file not created by sweep; move it", str(self.path(name).parent)))
            write_bytes(content, self.path(name))
        self.add({name: hashlib.sha256(content).hexdigest() for name, content in contents.items()})

    def write_table(self, name: str, table: pa.Table) -> None:
        """Write a table of the run and list it."""
        write_table(table, self.path(name))
        self.add({name: digest_of(self.path(name))})

    def add(self, digests: Mapping[str, str]) -> None:
        """List files that were written."""
        self.files |= digests
        self.save()

    def remove(self, names: Iterable[str]) -> None:
        """Remove files of the run and their entries."""
        gone = [name for name in names if name in self.files or os.path.lexists(self.path(name))]
        for name in gone:
            path = self.path(name)
            if not self._linked(name) and not is_real_folder(path):
                try:
                    path.unlink(missing_ok=True)
                except OSError as error:
                    raise OutputError(
                        ValidationIssue(f"cannot be removed: {error.strerror or error}", str(path))
                    ) from None
            self.files.pop(name, None)
        if gone:
            self.save()

    def discard_derived(self) -> None:
        """Remove the report, and what commands added, which follow from tables that are gone."""
        self.remove([name for name in self.files if is_drawn(name) or name in gathered("ADDED")])

    def discard(self) -> None:
        """Remove the manifest of a run without files."""
        if not self.files:
            with suppress(OSError):
                self.path(MANIFEST).unlink()

    def save(self) -> None:
        """Write the manifest."""
        content = json.loads(json_of(self.facts | {_FILES: self.files}))
        write_bytes(json_of(content | {_DIGEST: _digest(content)}).encode("utf-8"), self.path(MANIFEST))


def issues_of(folder: Path, wrong: Mapping[str, str]) -> list[ValidationIssue]:
    """Return a line for each file that is not as the run wrote it."""
    again, away = "`sweep run` of its study makes it again", "move it away"
    return [
        ValidationIssue(f"{what}; {away if what == _STRANGE else again}", str(folder / name))
        for name, what in wrong.items()
    ]


def _by_run(name: str) -> bool:
    return name in made_by_run() or name.startswith(f"{RESULTS}/")


def _digest(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _names(folder: Path) -> list[str]:
    """Return the names in a folder; none if there is no folder, or a link in its place."""
    try:
        return [] if is_link(folder) else [path.name for path in folder.iterdir()]
    except OSError:
        return []
