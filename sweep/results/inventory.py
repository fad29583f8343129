"""Which files in a run's folder are its own, and what they hold: damage is seen, and no other file is touched.

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
from ..base.errors import Fault, OutputError
from .atomic import write_bytes
from .names import FIGURES, RUN, SUMS, is_drawn, is_own
from .tables import AUDIT, PROVENANCE, json_of, write_table

_SUM = re.compile(r"([0-9a-f]{64})  (\S+)")
MISSING, DAMAGED, UNLISTED = "is missing", "is damaged", f"is not listed in {SUMS}"


class Inventory:
    """The files of a run's folder, empty where there is no run; raises OutputError for a damaged `run.json`.

    Attributes
    ----------
    folder : Path
    facts : dict
        What `run.json` says: `fingerprint` and `identity` of the study, and its number of designs.
    files : dict of str
        Name (`figures/chart.png`) -> SHA-256 of the file.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.files = {name: sha for sha, name in _SUM.findall(_text(folder / SUMS)) if is_own(name) or name == RUN}
        self.facts: dict[str, Any] = {}
        path = folder / RUN
        if os.path.lexists(path):
            with suppress(OSError):
                content = read_plain(path, MOST_FACTS)
                if self.files.get(RUN) in (None, hashlib.sha256(content).hexdigest()):
                    self.facts = parsed_facts(content)
            if not isinstance(self.facts.get("fingerprint"), str):
                problem = "is damaged, so that nothing is known of the run; move its folder away"
                raise OutputError(Fault(problem, str(path), allowed="another --output"))

    @property
    def fingerprint(self) -> str:
        """That of the run's study; empty where there is no run."""
        return str(self.facts.get("fingerprint", ""))

    def path(self, name: str) -> Path:
        """Where a file of the run stands."""
        return self.folder / name

    def wrong(self, names: Iterable[str] | None = None, *, quick: bool = False) -> dict[str, str]:
        """Files that are not what the run wrote -> what is wrong with them.

        Parameters
        ----------
        names : iterable of str, optional
            Files that are looked at; without it those that the list names, and of a finished run those it should.
        quick : bool
            Only say which are missing.
        """
        faults = dict.fromkeys(self.unlisted() if names is None else (), UNLISTED)
        for name in sorted(self.files if names is None else names):
            fault = self._fault(name, quick=quick)
            if fault is not None:
                faults[name] = fault
        return faults

    def unlisted(self) -> list[str]:
        """Files of a finished run that the list does not name, since it is damaged; provenance is written last."""
        finished = os.path.lexists(self.path(PROVENANCE))
        return [name for name in self._present() if finished and is_own(name) and name not in self.files]

    def _present(self) -> list[str]:
        """Names of the files in the folder and among its figures."""
        return sorted([*_names(self.folder), *(f"{FIGURES}/{name}" for name in _names(self.folder / FIGURES))])

    def _fault(self, name: str, *, quick: bool) -> str | None:
        path = self.path(name)
        if name not in self.files or not os.path.lexists(path) or self._linked(name):
            return MISSING
        if quick:
            return None
        try:
            return None if digest_of(path) == self.files[name] else DAMAGED
        except OSError:
            return DAMAGED

    def _linked(self, name: str) -> bool:
        """True where a link leads out of the folder on the way to a file."""
        return name.startswith(f"{FIGURES}/") and is_link(self.folder / FIGURES)

    def require(self, names: Iterable[str]) -> None:
        """Raise OutputError, naming each file, unless all of them are what the run wrote."""
        if wrong := self.wrong(names):
            raise OutputError(faults_of(self.folder, wrong))

    def strangers(self) -> list[str]:
        """Files of others under names that the run's commands give; none in the folder of a run."""
        if self.facts:
            return []
        return [name for name in self._present() if is_own(name) or name == SUMS]

    def begin(self, fingerprint: str, facts: Mapping[str, Any]) -> None:
        """Say whose folder it is; raises OutputError where files of others stand in the way or the disk refuses."""
        for name in self.strangers():
            raise OutputError(Fault("is not of this run; move it away", str(self.folder / name)))
        self.facts = {"fingerprint": fingerprint, **facts}
        self.write({RUN: json_of(self.facts).encode("utf-8")})

    def write(self, contents: Mapping[str, bytes]) -> None:
        """Write files of the run and list them; raises OutputError when the disk refuses."""
        for name, content in contents.items():
            if self._linked(name):
                raise OutputError(Fault("is not of this run; move it away", str(self.folder / FIGURES)))
            path = self.path(name)
            with suppress(OSError):  # an empty folder in its place goes
                path.rmdir()
            write_bytes(content, path)
            self.files[name] = hashlib.sha256(content).hexdigest()
        self._save()

    def write_table(self, name: str, table: pa.Table) -> None:
        """Write a table of the run and list it; errors as for `write`."""
        write_table(table, self.path(name))
        self.adopt(name)

    def adopt(self, name: str) -> None:
        """List a file that was written; raises OutputError when the disk refuses."""
        self.files[name] = digest_of(self.path(name))
        self._save()

    def remove(self, names: Iterable[str]) -> None:
        """Remove files with names of the run's and list them no longer; raises OutputError when the disk refuses."""
        gone = [name for name in names if name in self.files or os.path.lexists(self.path(name))]
        for name in gone:
            path = self.path(name)
            if not self._linked(name) and not is_real_folder(path):
                try:
                    path.unlink(missing_ok=True)
                except OSError as error:
                    raise OutputError(Fault(f"cannot be removed: {error.strerror or error}", str(path))) from None
            self.files.pop(name, None)
        if gone:
            self._save()

    def outdate(self) -> None:
        """Remove what was made of tables that are no more: report and audit; errors as for `remove`."""
        self.remove([name for name in self.files if is_drawn(name) or name == AUDIT])

    def discard(self) -> None:
        """Leave nothing of a run that has no file but its lists."""
        if not self.files.keys() - {RUN}:
            for name in (SUMS, RUN):
                with suppress(OSError):
                    self.path(name).unlink()

    def _save(self) -> None:
        lines = [f"{self.files[name]}  {name}\n" for name in sorted(self.files)]
        write_bytes("".join(lines).encode("utf-8"), self.path(SUMS))


def no_run(folder: Path) -> OutputError:
    """The error for a folder that holds no run."""
    return OutputError(Fault("no run here", str(folder), allowed="a folder that `sweep run` made"))


def faults_of(folder: Path, wrong: Mapping[str, str]) -> list[Fault]:
    """A line for each file that is not what the run wrote."""
    return [Fault(f"{what}; `sweep run` of its study makes it again", str(folder / n)) for n, what in wrong.items()]


def _names(folder: Path) -> list[str]:
    """Names in a folder; none where there is none, or a link in its place."""
    try:
        return [] if is_link(folder) else [path.name for path in folder.iterdir()]
    except OSError:
        return []


def _text(path: Path) -> str:
    """A file's text; none where there is no plain file of a likely size."""
    try:
        return read_plain(path, MOST_FACTS).decode("utf-8", "replace")
    except OSError:
        return ""
