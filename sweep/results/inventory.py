"""Inventory of the files in a run's folder: damage is noticed, and no other file is touched.

`run.json` says which study the folder is of. `SHA256SUMS` lists all files of the run, `run.json` included, in the form
that `sha256sum -c` checks. A folder without `run.json` is no run's: files in it that have names of a run's are others'.
Either may be damaged: the other, and provenance, still tell whose run it is, and what cannot be verified is said.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import pyarrow as pa

from ..base.disk import MOST_FACTS, digest_of, is_link, is_real_folder, parsed_facts, read_facts, read_plain
from ..base.errors import OutputError, ValidationIssue
from ..study import SensorAndLights
from .atomic import write_bytes
from .tables import (
    AUDIT,
    FIGURES,
    MADE_BY_RUN,
    PROVENANCE,
    RESULTS,
    RUN,
    SUMS,
    is_drawn,
    is_of_run,
    json_of,
    write_table,
)

_SUM = re.compile(r"([0-9a-f]{64})  (\S+)")
_MISSING, _DAMAGED, _UNLISTED = "is missing", "is damaged", f"is not listed in {SUMS}"


class Inventory:
    """The files of a run's folder, empty where there is no run.

    `files`: name (`figures/chart.png`) -> SHA-256 of the file; `damaged`: `run.json` is there, but not as the run wrote
    it; `facts` then has the fingerprint of the provenance, if any. `facts` is `run.json`: `fingerprint` and `identity`
    of the study, and its number of designs.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.files: dict[str, str] = {}
        self.facts: dict[str, Any] = {}
        self._lines = 0
        with suppress(OSError):
            lines = read_plain(folder / SUMS, MOST_FACTS).decode("utf-8", "replace").splitlines()
            entries = [entry for entry in map(_SUM.fullmatch, lines) if entry is not None]
            self.files = {name: sha for sha, name in (entry.groups() for entry in entries) if _is_listed(name)}
            self._lines = len(lines)
        self.damaged = os.path.lexists(folder / RUN) and not self._read_facts()

    def _read_facts(self) -> bool:
        """Read `run.json`; where it is damaged, the fingerprint alone, from the provenance."""
        with suppress(OSError):
            content = read_plain(self.path(RUN), MOST_FACTS)
            facts = parsed_facts(content)
            known = self.files.get(RUN) in (None, hashlib.sha256(content).hexdigest())
            if known and isinstance(facts.get("fingerprint"), str):
                self.facts = facts
                return True
        if PROVENANCE not in self.files or not self.wrong([PROVENANCE]):
            facts = read_facts(self.path(PROVENANCE))
            if isinstance(facts.get("fingerprint"), str):
                self.facts = {key: facts[key] for key in ("fingerprint", "runs") if key in facts}
        return False

    @property
    def fingerprint(self) -> str:
        """Fingerprint of the run's study; empty without a run."""
        return str(self.facts.get("fingerprint", ""))

    def is_of(self, facts: Mapping[str, Any]) -> bool:
        """Return whether the folder holds the run with some facts; a list alone tells, too."""
        if self.damaged and self.files.get(RUN) == hashlib.sha256(json_of(facts).encode("utf-8")).hexdigest():
            return True
        return self.fingerprint == str(facts["fingerprint"])

    def require_run(self) -> None:
        """Raise OutputError if nothing tells which run the folder is of."""
        if self.damaged and not self.fingerprint:
            problem = "is damaged, so that nothing is known of the run; move its folder away"
            raise OutputError(ValidationIssue(problem, str(self.path(RUN)), allowed="another --output"))
        if not self.fingerprint:
            raise OutputError(
                ValidationIssue("no run here", str(self.folder), allowed="a folder that `sweep run` made")
            )

    @property
    def runs(self) -> list[SensorAndLights]:
        """Sensors and lights of a study of several; none of another."""
        stated = self.facts.get("runs")
        pairs = stated if isinstance(stated, list) else []
        known = [pair for pair in pairs if isinstance(pair, list) and [type(name) for name in pair] == [str, str]]
        return [SensorAndLights(sensor, lights, (at, at)) for at, (sensor, lights) in enumerate(known)]

    @property
    def list_damaged(self) -> bool:
        """True if the list has strange lines, or does not name what a finished run has."""
        return self._lines > len(self.files) or bool(self.unlisted())

    @property
    def unverified(self) -> list[str]:
        """Files that the damaged lists of a finished run cannot vouch for."""
        cut = self._lines > len(self.files) or {PROVENANCE, RESULTS}.intersection(self.unlisted())
        return sorted({*([RUN] if self.damaged else []), *(self.unlisted() if cut else [])})

    @property
    def finished(self) -> bool:
        """True if all listed files are there, provenance among them."""
        listed = self.files.keys() & MADE_BY_RUN
        return PROVENANCE in listed and not self.wrong(listed, quick=True)

    def path(self, name: str) -> Path:
        """Return the path of a file of the run."""
        return self.folder / name

    def wrong(self, names: Iterable[str] | None = None, *, quick: bool = False) -> dict[str, str]:
        """Return the files that differ from those of the run, and their issues.

        `names`: files that are looked at; without it those that the list names, and of a finished run those it should.
        """
        issues = dict.fromkeys(self.unlisted() if names is None else (), _UNLISTED)
        if names is None and self._lines > len(self.files):
            issues[SUMS] = _DAMAGED
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

    def unlisted(self) -> list[str]:
        """Return the files of a finished run that a damaged list does not name; provenance is written last."""
        finished = os.path.lexists(self.path(PROVENANCE))
        return [name for name in self._present() if finished and _is_listed(name) and name not in self.files]

    def _present(self) -> list[str]:
        """Return the names of the files in the folder and among its figures."""
        return sorted([*_names(self.folder), *(f"{FIGURES}/{name}" for name in _names(self.folder / FIGURES))])

    def _linked(self, name: str) -> bool:
        """Return whether a link on the way to a file leads out of the folder."""
        return name.startswith(f"{FIGURES}/") and is_link(self.folder / FIGURES)

    def require(self, names: Iterable[str]) -> None:
        """Check that files are as the run wrote them, but for those that damaged lists cannot vouch for.

        Raises OutputError if a file is missing or damaged, with its name.
        """
        unverified = self.unverified
        if wrong := self.wrong([name for name in names if name not in unverified]):
            raise OutputError(issues_of(self.folder, wrong))

    def foreign_files(self) -> list[str]:
        """Return the files of others under names that the run's commands give; none in the folder of a run."""
        if self.facts or self.damaged:
            return []
        return [name for name in self._present() if is_of_run(name) or name == SUMS]

    def begin(self, facts: Mapping[str, Any]) -> None:
        """Write which study the folder is of.

        Raises OutputError if files of others are there, or the disk refuses.
        """
        for name in self.foreign_files():
            raise OutputError(ValidationIssue("file not created by sweep; move it", str(self.folder / name)))
        self.facts, self.damaged = dict(facts), False
        self.write({RUN: json_of(self.facts).encode("utf-8")})

    def write(self, contents: Mapping[str, bytes]) -> None:
        """Write files of the run and list them."""
        for name, content in contents.items():
            if self._linked(name):
                raise OutputError(ValidationIssue("file not created by sweep; move it", str(self.folder / FIGURES)))
            path = self.path(name)
            with suppress(OSError):  # an empty folder in its place goes
                path.rmdir()
            write_bytes(content, path)
            self.files[name] = hashlib.sha256(content).hexdigest()
        self._save()

    def write_table(self, name: str, table: pa.Table) -> None:
        """Write a table of the run and list it."""
        write_table(table, self.path(name))
        self.list_file(name)

    def list_file(self, name: str) -> None:
        """List a file that was written."""
        self.files[name] = digest_of(self.path(name))
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
        """Remove the lists of a run without files."""
        if not self.files.keys() - {RUN}:
            for name in (SUMS, RUN):
                with suppress(OSError):
                    self.path(name).unlink()

    def _save(self) -> None:
        lines = [f"{self.files[name]}  {name}\n" for name in sorted(self.files)]
        write_bytes("".join(lines).encode("utf-8"), self.path(SUMS))


def issues_of(folder: Path, wrong: Mapping[str, str]) -> list[ValidationIssue]:
    """Return a line for each file that is not as the run wrote it."""
    return [
        ValidationIssue(f"{what}; `sweep run` of its study makes it again", str(folder / n))
        for n, what in wrong.items()
    ]


def _is_listed(name: str) -> bool:
    return is_of_run(name) or name == RUN


def _names(folder: Path) -> list[str]:
    """Return the names in a folder; none if there is no folder, or a link in its place."""
    try:
        return [] if is_link(folder) else [path.name for path in folder.iterdir()]
    except OSError:
        return []
