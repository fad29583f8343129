"""Inventory of the files in a run's folder: damage is noticed, and no other file is touched.

`run.json` says which study the folder is of. `SHA256SUMS` lists all files of the run, `run.json` included, in the form
that `sha256sum -c` checks. A folder without `run.json` is no run's: files in it that have names of a run's are others'.
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

from ..base.disk import MOST_FACTS, digest_of, is_link, is_real_folder, parsed_facts, read_plain
from ..base.errors import OutputError, ValidationIssue
from .atomic import write_bytes
from .tables import AUDIT, FIGURES, MADE_BY_RUN, PROVENANCE, RUN, SUMS, is_drawn, is_user_code, json_of, write_table

_SUM = re.compile(r"([0-9a-f]{64})  (\S+)")
_MISSING, _DAMAGED, _UNLISTED = "is missing", "is damaged", f"is not listed in {SUMS}"


class Inventory:
    """The files of a run's folder, empty where there is no run; raises OutputError for a damaged `run.json`.

    Attributes
    ----------
    folder : Path
    facts : dict
        Contents of `run.json`: `fingerprint` and `identity` of the study, and its number of designs.
    files : dict of str
        Name (`figures/chart.png`) -> SHA-256 of the file.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.files: dict[str, str] = {}
        self.facts: dict[str, Any] = {}
        with suppress(OSError):
            text = read_plain(folder / SUMS, MOST_FACTS).decode("utf-8", "replace")
            self.files = {name: sha for sha, name in _SUM.findall(text) if is_user_code(name) or name == RUN}
        path = folder / RUN
        if os.path.lexists(path):
            with suppress(OSError):
                content = read_plain(path, MOST_FACTS)
                if self.files.get(RUN) in (None, hashlib.sha256(content).hexdigest()):
                    self.facts = parsed_facts(content)
            if not isinstance(self.facts.get("fingerprint"), str):
                problem = "is damaged, so that nothing is known of the run; move its folder away"
                raise OutputError(ValidationIssue(problem, str(path), allowed="another --output"))

    @property
    def fingerprint(self) -> str:
        """Fingerprint of the run's study; empty without a run."""
        return str(self.facts.get("fingerprint", ""))

    @property
    def finished(self) -> bool:
        """True if all listed files are there, provenance among them."""
        listed = self.files.keys() & MADE_BY_RUN
        return PROVENANCE in listed and not self.wrong(listed, quick=True)

    def path(self, name: str) -> Path:
        """Return the path of a file of the run.

        Parameters
        ----------
        name : str
            Name of the file.

        Returns
        -------
        Path
            Path.
        """
        return self.folder / name

    def wrong(self, names: Iterable[str] | None = None, *, quick: bool = False) -> dict[str, str]:
        """Return the files that differ from those of the run, and their issues.

        Parameters
        ----------
        names : iterable of str, optional
            Files that are looked at; without it those that the list names, and of a finished run those it should.
        quick : bool
            Only say which are missing.
        """
        issues = dict.fromkeys(self.unlisted() if names is None else (), _UNLISTED)
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
        """Return the files of a finished run that a damaged list does not name; provenance is written last.

        Returns
        -------
        list of str
            Names.
        """
        finished = os.path.lexists(self.path(PROVENANCE))
        return [name for name in self._present() if finished and is_user_code(name) and name not in self.files]

    def _present(self) -> list[str]:
        """Return the names of the files in the folder and among its figures."""
        return sorted([*_names(self.folder), *(f"{FIGURES}/{name}" for name in _names(self.folder / FIGURES))])

    def _linked(self, name: str) -> bool:
        """Return whether a link on the way to a file leads out of the folder."""
        return name.startswith(f"{FIGURES}/") and is_link(self.folder / FIGURES)

    def require(self, names: Iterable[str]) -> None:
        """Check that files are as the run wrote them.

        Parameters
        ----------
        names : iterable of str
            Names of files.

        Raises
        ------
        OutputError
            If a file is missing or damaged, with its name.
        """
        if wrong := self.wrong(names):
            raise OutputError(issues_of(self.folder, wrong))

    def foreign_files(self) -> list[str]:
        """Return the files of others under names that the run's commands give; none in the folder of a run.

        Returns
        -------
        list of str
            Names.
        """
        if self.facts:
            return []
        return [name for name in self._present() if is_user_code(name) or name == SUMS]

    def begin(self, fingerprint: str, facts: Mapping[str, Any]) -> None:
        """Write which study the folder is of.

        Parameters
        ----------
        fingerprint : str
            Fingerprint of the study.
        facts : mapping
            Further content of `run.json`.

        Raises
        ------
        OutputError
            If files of others are there, or the disk refuses.
        """
        for name in self.foreign_files():
            raise OutputError(ValidationIssue("is not of this run; move it away", str(self.folder / name)))
        self.facts = {"fingerprint": fingerprint, **facts}
        self.write({RUN: json_of(self.facts).encode("utf-8")})

    def write(self, contents: Mapping[str, bytes]) -> None:
        """Write files of the run and list them.

        Parameters
        ----------
        contents : mapping of str to bytes
            Content by name.

        Raises
        ------
        OutputError
            If the disk refuses.
        """
        for name, content in contents.items():
            if self._linked(name):
                raise OutputError(ValidationIssue("is not of this run; move it away", str(self.folder / FIGURES)))
            path = self.path(name)
            with suppress(OSError):  # an empty folder in its place goes
                path.rmdir()
            write_bytes(content, path)
            self.files[name] = hashlib.sha256(content).hexdigest()
        self._save()

    def write_table(self, name: str, table: pa.Table) -> None:
        """Write a table of the run and list it.

        Parameters
        ----------
        name : str
            Name of the file.
        table : pyarrow.Table
            Table.

        Raises
        ------
        OutputError
            If the disk refuses.
        """
        write_table(table, self.path(name))
        self.list_file(name)

    def list_file(self, name: str) -> None:
        """List a file that was written.

        Parameters
        ----------
        name : str
            Name of the file.

        Raises
        ------
        OutputError
            If the disk refuses.
        """
        self.files[name] = digest_of(self.path(name))
        self._save()

    def remove(self, names: Iterable[str]) -> None:
        """Remove files of the run and their entries.

        Parameters
        ----------
        names : iterable of str
            Names of files.

        Raises
        ------
        OutputError
            If the disk refuses.
        """
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


def no_run(folder: Path) -> OutputError:
    """Return the error for a folder without a run.

    Parameters
    ----------
    folder : Path
        Folder.

    Returns
    -------
    OutputError
        Error.
    """
    return OutputError(ValidationIssue("no run here", str(folder), allowed="a folder that `sweep run` made"))


def issues_of(folder: Path, wrong: Mapping[str, str]) -> list[ValidationIssue]:
    """Return a line for each file that is not as the run wrote it.

    Parameters
    ----------
    folder : Path
        Folder.
    wrong : mapping of str to str
        Problem by name.

    Returns
    -------
    list of Fault
        Lines.
    """
    return [
        ValidationIssue(f"{what}; `sweep run` of its study makes it again", str(folder / n))
        for n, what in wrong.items()
    ]


def _names(folder: Path) -> list[str]:
    """Return the names in a folder; none if there is no folder, or a link in its place."""
    try:
        return [] if is_link(folder) else [path.name for path in folder.iterdir()]
    except OSError:
        return []
