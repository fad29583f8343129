"""Which files in a run's folder are its own, and what they hold: a run touches no other, and damage is seen.

`run.json` lists the files with SHA-256 and size, and carries a digest of its own text; `SHA256SUMS` says the same in
the form that `sha256sum -c` checks, `run.json` included. Either makes the other again. A file is listed before it takes
its name: what stands in the folder and is not listed belongs to someone else, and is neither replaced nor removed.
"""

from __future__ import annotations

import hashlib
import os
import re
import stat
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import pyarrow as pa

from ..base.disk import MOST_FACTS, Digest, digest_of, is_link, is_real_folder, parsed_facts, read_plain
from ..base.errors import Fault, OutputError
from .atomic import Seal, write_bytes
from .names import FIGURES, RUN, SUMS, is_drawn, is_own
from .tables import AUDIT, json_of, write_table

_SUM = re.compile(r"([0-9a-f]{64})  (\S+)")
_FINGERPRINT = re.compile(r"# run ([0-9a-f]{64})\b")
_OWN_DIGEST = re.compile(rb'"sha256_of_the_rest": "([0-9a-f]{64})"')
_ZEROS = "0" * 64
"""Stands for the digest of a file that is out of date, and for that of the list itself while it is found."""
MISSING, DAMAGED, OUTDATED = "is missing", "is damaged", "is out of date"


class Inventory:
    """The files of a run's folder as its lists name them; empty where there is no run.

    `files`: name (`figures/chart.png`) -> what it holds. `facts`: what `run.json` says besides; `guarded`: whether it
    has its digest, else they are what could still be read. `fingerprint`: of the run, empty where none is known.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.files: dict[str, Digest] = {}
        content = _content(folder / RUN)
        self.facts = parsed_facts(content)
        self.guarded = _own_digest(content) and isinstance(self.facts.get("fingerprint"), str)
        listed, text = self.facts.pop("files", None), _content(folder / SUMS).decode("utf-8", "replace")
        self.facts.pop("sha256_of_the_rest", None)
        if self.guarded:
            self.fingerprint = str(self.facts["fingerprint"])
            self.files = _listed(listed)
            self.agreed = text == self._sums(content)
        else:
            named = _FINGERPRINT.match(text)
            self.fingerprint = named.group(1) if named else ""
            self.files = {name: Digest(sha, None) for sha, name in _SUM.findall(text) if is_own(name)}
            self.agreed = False

    def path(self, name: str) -> Path:
        """Where a file of the run stands."""
        return self.folder / name

    def wrong(self, names: Iterable[str] | None = None, *, quick: bool = False) -> dict[str, str]:
        """Listed files (of `names` all, listed or not) that are not what the run wrote -> what is wrong with them.

        `quick` compares sizes alone.
        """
        found = {}
        for name in sorted(self.files) if names is None else names:
            fault = self._fault(name, quick)
            if fault is not None:
                found[name] = fault
        return found

    def wrong_lists(self) -> dict[str, str]:
        """Which of the two lists is not what was written -> what is wrong with it. With neither, nothing is known."""
        if not self.fingerprint or self.agreed:
            return {}
        name = SUMS if self.guarded else RUN
        return {name: DAMAGED if os.path.lexists(self.path(name)) else MISSING}

    def require(self, names: Iterable[str]) -> None:
        """Raises OutputError, naming each file, unless all of them are what the run wrote."""
        wrong = self.wrong(names)
        if wrong:
            raise OutputError(faults_of(self.folder, wrong))

    def strangers(self) -> list[str]:
        """Files of others under names that the run's commands give, and links in the place of its folder."""
        own = {RUN, SUMS} if self.fingerprint else set()
        names = [*_names(self.folder), *(f"{FIGURES}/{name}" for name in _names(self.folder / FIGURES))]
        found = [n for n in names if (is_own(n) or n in (RUN, SUMS)) and n not in self.files and n not in own]
        if not self._within(f"{FIGURES}/"):
            found.append(FIGURES)
        return sorted(found)

    def begin(self, fingerprint: str, facts: Mapping[str, Any]) -> None:
        """Say whose folder it is; raises OutputError where files of others stand in the way or the disk refuses."""
        strangers = self.strangers()
        if strangers:
            raise _in_the_way(self.folder, strangers[0])
        self.fingerprint, self.facts = fingerprint, {"fingerprint": fingerprint, **facts}
        self.save()

    def save(self) -> None:
        """Write both lists where they are not what they should be; raises OutputError when the disk refuses."""
        self.files = {name: self._with_size(name, held) for name, held in self.files.items()}
        files = {name: {"sha256": held.sha256, "size": held.size} for name, held in self.files.items()}
        whole = {**self.facts, "files": files, "sha256_of_the_rest": _ZEROS}
        blank = json_of(whole).encode("utf-8")
        content = json_of({**whole, "sha256_of_the_rest": hashlib.sha256(blank).hexdigest()}).encode("utf-8")
        for name, wanted in ((RUN, content), (SUMS, self._sums(content).encode("utf-8"))):
            if _content(self.path(name)) != wanted:
                _without_empty_folder(self.path(name))
                write_bytes(wanted, self.path(name))
        self.guarded = self.agreed = True

    def write(self, contents: Mapping[str, bytes]) -> None:
        """Write files of the run; raises OutputError where a file of others has the name or the disk refuses."""
        for name in contents:
            self._free(name)
        self.files |= {
            name: Digest(hashlib.sha256(content).hexdigest(), len(content)) for name, content in contents.items()
        }
        self.save()
        for name, content in contents.items():
            write_bytes(content, self.path(name))

    def write_table(self, name: str, table: pa.Table) -> None:
        """Write a table of the run; errors as for `write`."""
        write_table(table, self.path(name), self.seal(name))

    def seal(self, name: str) -> Seal:
        """What lists a file that is written to its end, before it takes its name; errors as for `write`."""

        def list_it(hidden: Path, digest: Digest | None = None) -> None:
            self._free(name)
            self.files[name] = digest_of(hidden) if digest is None else digest
            self.save()

        return list_it

    def remove(self, names: Iterable[str]) -> None:
        """Remove files of the run and list them no longer; raises OutputError when the disk refuses."""
        gone = [name for name in names if name in self.files]
        for name in gone:
            if self._within(name) and not is_real_folder(self.path(name)):
                try:
                    self.path(name).unlink(missing_ok=True)
                except OSError as error:
                    raise OutputError(
                        Fault(f"cannot be removed: {error.strerror or error}", str(self.path(name)))
                    ) from None
            del self.files[name]
        if gone:
            self.save()

    def outdate(self, *, rows: bool) -> None:
        """The report, and where the `rows` are others the audit, are not of what the folder holds now.

        Raises OutputError when the disk refuses.
        """
        old = [name for name in self.files if is_drawn(name) or (rows and name == AUDIT)]
        if old:
            self.files |= dict.fromkeys(old, Digest(_ZEROS, 0))
            self.save()

    def discard(self) -> bool:
        """Leave nothing of a run that has no file but its lists; says whether it was one."""
        if self.files:
            return False
        for name in (RUN, SUMS):
            with suppress(OSError):
                self.path(name).unlink()
        return True

    def _fault(self, name: str, quick: bool) -> str | None:
        """What is wrong with a file; None when nothing is."""
        held, path = self.files.get(name), self.path(name)
        if held is None or not self._within(name) or not os.path.lexists(path):
            return MISSING
        if held.sha256 == _ZEROS:
            return OUTDATED
        try:
            if not quick:
                found = digest_of(path)
                return None if found.sha256 == held.sha256 else DAMAGED
            here = path.lstat()
        except OSError:
            return DAMAGED
        return None if stat.S_ISREG(here.st_mode) and held.size in (None, here.st_size) else DAMAGED

    def _within(self, name: str) -> bool:
        """Whether no link leads out of the folder on the way to a file."""
        return not (name.startswith(f"{FIGURES}/") and is_link(self.folder / FIGURES))

    def _free(self, name: str) -> None:
        """Raises OutputError where something that is not the run's stands under a name."""
        path = self.path(name)
        if not self._within(name):
            raise _in_the_way(self.folder, FIGURES)
        if os.path.lexists(path) and name not in self.files:
            raise _in_the_way(self.folder, name)
        _without_empty_folder(path)
        if is_real_folder(path):
            raise _in_the_way(self.folder, name)

    def _with_size(self, name: str, held: Digest) -> Digest:
        """The digest with its size, which `SHA256SUMS` does not say."""
        if held.size is not None:
            return held
        with suppress(OSError):
            return Digest(held.sha256, self.path(name).lstat().st_size)
        return Digest(held.sha256, 0)

    def _sums(self, run: bytes) -> str:
        """The text of `SHA256SUMS`; `run`: of `run.json`."""
        digests = {name: held.sha256 for name, held in self.files.items()} | {RUN: hashlib.sha256(run).hexdigest()}
        lines = [f"{digests[name]}  {name}" for name in sorted(digests)]
        return "\n".join([f"# run {self.fingerprint}; check its files: sha256sum -c {SUMS}", *lines, ""])


def no_run(folder: Path) -> OutputError:
    """What there is to say of a folder whose run is not known."""
    if Inventory(folder).strangers():
        problem = f"not a run of this version, or its {RUN} and {SUMS} are both missing or damaged"
        return OutputError(Fault(problem, str(folder), allowed="a folder that `sweep run` made"))
    return OutputError(Fault("no run here", str(folder), allowed="a folder that `sweep run` made"))


def faults_of(folder: Path, wrong: Mapping[str, str]) -> list[Fault]:
    """A line for each file that is not what the run wrote."""
    return [Fault(f"{what}; `sweep run` of its study makes it again", str(folder / n)) for n, what in wrong.items()]


def _in_the_way(folder: Path, name: str) -> OutputError:
    return OutputError(Fault("is not of this run; move it away", str(folder / name), allowed="another --output"))


def _without_empty_folder(path: Path) -> None:
    """A folder in the place of a file goes, if nothing is in it."""
    if is_real_folder(path):
        with suppress(OSError):
            path.rmdir()


def _names(folder: Path) -> list[str]:
    """Names in a folder; none where there is none, or a link in its place."""
    try:
        return [] if is_link(folder) else [path.name for path in folder.iterdir()]
    except OSError:
        return []


def _content(path: Path) -> bytes:
    """A file's bytes; none where there is no plain file of a likely size."""
    try:
        return read_plain(path, MOST_FACTS)
    except OSError:
        return b""


def _own_digest(content: bytes) -> bool:
    """Whether the text of `run.json` has the digest that it carries, taken with zeros in its place."""
    found = list(_OWN_DIGEST.finditer(content))
    if len(found) != 1:
        return False
    start, stop = found[0].span(1)
    blank = content[:start] + _ZEROS.encode() + content[stop:]
    return hashlib.sha256(blank).hexdigest().encode() == found[0].group(1)


def _listed(files: object) -> dict[str, Digest]:
    """The files that `run.json` names; what no command writes is left out."""
    found = {}
    for name, held in files.items() if isinstance(files, dict) else ():
        if is_own(name) and isinstance(held, dict):
            sha256, size = held.get("sha256"), held.get("size")
            if isinstance(sha256, str) and re.fullmatch("[0-9a-f]{64}", sha256) and type(size) is int and size >= 0:
                found[name] = Digest(sha256, size)
    return found
