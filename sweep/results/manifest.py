"""Manifest of a run's folder: which study it is of, and the digest of each of its files.

A folder without `manifest.json` is no run's: files in it that have names of a run's are others'.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import pyarrow as pa

from ..base.disk import digest_of, is_link, is_real_folder, read_facts
from ..base.errors import OutputError, ValidationIssue
from ..study import SensorAndLights
from .atomic import write_bytes
from .dataset import part_paths
from .tables import (
    AUDIT,
    FIGURES,
    MADE_BY_RUN,
    MANIFEST,
    PROVENANCE,
    RESULTS,
    is_drawn,
    is_of_run,
    json_of,
    write_table,
)

_FOLDERS = (FIGURES, RESULTS)
_MISSING, _DAMAGED = "is missing", "is damaged"
_DIGEST, _FILES = "digest", "files"


class Manifest:
    """The files of a run's folder, empty where there is no run.

    `files`: name (`figures/chart.svg`) -> SHA-256 of the file; `facts`: `fingerprint` and `identity` of the study, and
    its number of designs; `damaged`: the manifest is there, but not as the run wrote it.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.facts = read_facts(folder / MANIFEST)
        digest = self.facts.pop(_DIGEST, None)
        self.damaged = os.path.lexists(folder / MANIFEST) and digest != _digest(self.facts)
        self.files: dict[str, str] = self.facts.pop(_FILES, {})
        if self.damaged:
            self.facts, self.files = {}, {}

    @property
    def fingerprint(self) -> str:
        """Fingerprint of the run's study; empty without a run."""
        return str(self.facts.get("fingerprint", ""))

    def is_of(self, facts: Mapping[str, Any]) -> bool:
        """Return whether the folder holds the run with some facts."""
        return self.fingerprint == str(facts["fingerprint"])

    def require_run(self) -> None:
        """Raise OutputError if nothing tells which run the folder is of."""
        if self.damaged:
            problem = "is damaged, so that nothing is known of the run; move its folder away"
            raise OutputError(ValidationIssue(problem, str(self.path(MANIFEST)), allowed="another --output"))
        if not self.fingerprint:
            raise OutputError(
                ValidationIssue("no run here", str(self.folder), allowed="a folder that `sweep run` made")
            )

    @property
    def runs(self) -> list[SensorAndLights]:
        """Sensors and lights of a study of several; none of another."""
        pairs = self.facts.get("runs", [])
        return [SensorAndLights(sensor, lights, (at, at)) for at, (sensor, lights) in enumerate(pairs)]

    @property
    def finished(self) -> bool:
        """True if all files are there, provenance among them."""
        return PROVENANCE in self.files and not self.wrong(filter(_by_run, self.files), quick=True)

    def rows(self) -> list[str]:
        """Return the parts in the folder, listed or not."""
        return [f"{RESULTS}/{path.name}" for path in part_paths(self.folder)]

    def path(self, name: str) -> Path:
        """Return the path of a file of the run."""
        return self.folder / name

    def wrong(self, names: Iterable[str] | None = None, *, quick: bool = False) -> dict[str, str]:
        """Return the files that differ from those of the run, and their issues.

        `names`: files that are looked at; left out, all; `quick`: only whether they are there.
        """
        issues: dict[str, str] = {}
        for name in sorted(self.files if names is None else names):
            path = self.path(name)
            if name not in self.files or not os.path.lexists(path) or self._linked(name):
                issues[name] = _MISSING
            elif not quick:
                try:
                    damaged = digest_of(path) != self.files[name]
                except OSError:
                    damaged = True
                if damaged:
                    issues[name] = _DAMAGED
        return issues

    def _linked(self, name: str) -> bool:
        """Return whether a link on the way to a file leads out of the folder."""
        return any(name.startswith(f"{inner}/") and is_link(self.folder / inner) for inner in _FOLDERS)

    def require(self, names: Iterable[str]) -> None:
        """Raise OutputError if a file is missing or damaged, with its name."""
        if wrong := self.wrong(names):
            raise OutputError(issues_of(self.folder, wrong))

    def foreign_files(self) -> list[str]:
        """Return the files of others under names that the run's commands give; none in the folder of a run."""
        if self.facts or self.damaged:
            return []
        inner = [f"{folder}/{name}" for folder in _FOLDERS for name in _names(self.folder / folder)]
        return sorted(name for name in [*_names(self.folder), *inner] if is_of_run(name))

    def begin(self, facts: Mapping[str, Any]) -> None:
        """Write which study the folder is of.

        Raises OutputError if files of others are there, or the disk refuses.
        """
        for name in self.foreign_files():
            raise OutputError(ValidationIssue("file not created by sweep; move it", str(self.folder / name)))
        self.facts = dict(facts)
        self._save()

    def write(self, contents: Mapping[str, bytes]) -> None:
        """Write files of the run and list them."""
        for name, content in contents.items():
            if self._linked(name):
                raise OutputError(ValidationIssue("file not created by sweep; move it", str(self.path(name).parent)))
            path = self.path(name)
            with suppress(OSError):  # an empty folder in its place goes
                path.rmdir()
            write_bytes(content, path)
        self.add({name: hashlib.sha256(content).hexdigest() for name, content in contents.items()})

    def write_table(self, name: str, table: pa.Table) -> None:
        """Write a table of the run and list it."""
        write_table(table, self.path(name))
        self.add({name: digest_of(self.path(name))})

    def add(self, digests: Mapping[str, str]) -> None:
        """List files that were written."""
        self.files |= digests
        self._save()

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
            self._save()

    def discard_derived(self) -> None:
        """Remove report and audit, which follow from tables that are gone."""
        self.remove([name for name in self.files if is_drawn(name) or name == AUDIT])

    def discard(self) -> None:
        """Remove the manifest of a run without files."""
        if not self.files:
            with suppress(OSError):
                self.path(MANIFEST).unlink()

    def _save(self) -> None:
        content = json.loads(json_of(self.facts | {_FILES: self.files}))
        write_bytes(json_of(content | {_DIGEST: _digest(content)}).encode("utf-8"), self.path(MANIFEST))


def issues_of(folder: Path, wrong: Mapping[str, str]) -> list[ValidationIssue]:
    """Return a line for each file that is not as the run wrote it."""
    return [
        ValidationIssue(f"{what}; `sweep run` of its study makes it again", str(folder / n))
        for n, what in wrong.items()
    ]


def _by_run(name: str) -> bool:
    return name in MADE_BY_RUN or name.startswith(f"{RESULTS}/")


def _digest(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _names(folder: Path) -> list[str]:
    """Return the names in a folder; none if there is no folder, or a link in its place."""
    try:
        return [] if is_link(folder) else [path.name for path in folder.iterdir()]
    except OSError:
        return []
