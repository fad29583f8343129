"""Code that is not the package's: of a Python file that a study names, or of an installed package that offers it."""

from __future__ import annotations

import ast
import hashlib
import sys
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

from .disk import is_file, read_input
from .errors import SweepError, ValidationIssue

Offered = Literal["sweep.families", "sweep.metrics", "sweep.effects", "sweep.sensors", "sweep.lights"]
"""Groups of entry points of plugins that a study can name."""
CODE_OF = "code of "
"""How the digest of an installed package's code is named among those of a study's files."""
_SEPARATOR = ".py:"
_MOST_BYTES = 1_000_000
_MOST_LETTERS = 300
_begun: dict[str, str] = {}
"""Digests of the packages that this process has loaded, which Python does not load again."""


def is_in_file(name: str) -> bool:
    """Return True if a name refers to a Python file, as `my_filters.py:Gauss` does."""
    return _SEPARATOR in name


def file_of(name: str) -> str:
    """Return the file part of `FILE.py:NAME`."""
    return f"{name.partition(_SEPARATOR)[0]}.py"


def name_in_file(name: str) -> str:
    """Return the name part of `FILE.py:NAME`.

    Unchanged if it has no file.
    """
    return name.partition(_SEPARATOR)[2] or name


def kind_in_words(name: str) -> str:
    """Return the name of a family for messages."""
    return name_in_file(name) if is_in_file(name) else name.replace("_", " ")


def is_code(digested: str) -> bool:
    """Return True if an input digest of a run belongs to code.

    True for Python files and installed packages.
    """
    return digested.endswith(".py") or digested.startswith(CODE_OF)


@dataclass(frozen=True)
class UserCode:
    """Code that a study names, as a worker process gets it: its name, and the text of its file or its group.

    `digest`: that of an installed package, which a worker must have, too. Nothing runs before `loaded` is asked for.
    """

    name: str
    source: str | None = None
    group: Offered | None = None
    digest: str = ""

    @property
    def loaded(self) -> Any:
        """The class, function or value itself, made once in a process; raises SweepError."""
        return _loaded(self)

    def called(self, function: Any, *arguments: Any) -> Any:
        """Call a function of the user's code.

        Raises SweepError, one line, for any exception of the function.
        """
        try:
            return function(*arguments)
        except (Exception, SystemExit) as error:  # it may raise anything
            raise SweepError(ValidationIssue(f"{self.name}: {_error_text(error)}")) from None


def _error_text(error: BaseException) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())[:_MOST_LETTERS]


@lru_cache(maxsize=64)
def _loaded(code: UserCode) -> Any:
    if code.source is not None:
        return _of_file(code.name, code.source)
    assert code.group is not None
    offer = installed(code.group, code.name)
    if offer is None:
        raise SweepError(
            ValidationIssue("no installed package offers it", value=code.name, allowed=f"one with `{code.group}`")
        )
    if offer.digest != code.digest or _begun.setdefault(offer.package, code.digest) != code.digest:
        problem = f"the code of {offer.description} is not that with which the study was loaded"
        raise SweepError(
            ValidationIssue(problem, value=code.name, allowed="the same package everywhere, and a new process")
        )
    try:
        return offer.entry.load()
    except (Exception, SystemExit) as error:
        raise SweepError(
            ValidationIssue(f"{code.name} cannot be loaded: {_error_text(error)}", offer.entry.value)
        ) from None


def _of_file(name: str, source: str) -> Any:
    """Run the text of a file, and return the named object."""
    file, name_inside = file_of(name), name_in_file(name)
    module = ModuleType(f"sweep_own_{hashlib.sha256(source.encode()).hexdigest()[:16]}")
    sys.modules[module.__name__] = module  # a dataclass looks there for the types that its fields name
    try:
        exec(compile(source, file, "exec", dont_inherit=True), module.__dict__)  # allowed by `--allow-code`
    except (Exception, SystemExit) as error:
        sys.modules.pop(module.__name__, None)  # the code may have taken it away
        raise SweepError(ValidationIssue(f"the code cannot be run: {_error_text(error)}", file)) from None
    member = getattr(module, name_inside, None)
    if not callable(member):
        defined = [key for key, value in vars(module).items() if getattr(value, "__module__", None) == module.__name__]
        known = ", ".join(defined) or "a class or function"
        raise SweepError(
            ValidationIssue("no such class or function in the file", file, value=name_inside, allowed=known)
        )
    return member


def read_code(path: Path) -> tuple[str, str]:
    """Read a Python file without running it.

    Returns source and SHA-256 digest. Raises SweepError if the file is missing, too large or not UTF-8.
    """
    content = read_input(path, _MOST_BYTES, SweepError)
    try:
        return content.decode("utf-8-sig"), hashlib.sha256(content).hexdigest()
    except UnicodeDecodeError:
        raise SweepError(ValidationIssue("not UTF-8 text", str(path))) from None


def beside(place: Path, source: str) -> list[Path]:
    """Return the files in the folder of some code that it depends on: what it imports, and what its `FILES` names.

    Nothing runs: `FILES` is a plain list of names. Raises SweepError if one of those is missing.
    """
    found, texts = dict[Path, None](), [source]
    while texts:
        try:
            nodes = [*ast.walk(ast.parse(texts.pop()))]
        except (SyntaxError, ValueError, RecursionError):
            continue  # which is said when it is to run
        imported = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
        imported += [node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module]
        for name in imported:
            top = place.parent / name.partition(".")[0]
            for path in [*filter(is_file, [top.with_suffix(".py")]), *sorted(top.rglob("*.py"))]:
                if path not in found and path != place:
                    found[path] = None
                    texts.append(read_code(path)[0])
        for name in _files_in(nodes):
            if not is_file(place.parent / name):
                raise SweepError(ValidationIssue("no such file, which FILES names", str(place), value=name))
            found[place.parent / name] = None
    return [*found]


def _files_in(nodes: list[ast.AST]) -> list[str]:
    """Return the names in `FILES = [...]` of a module."""
    for node in nodes:
        if isinstance(node, ast.Assign) and [ast.unparse(target) for target in node.targets] == ["FILES"]:
            with suppress(ValueError):
                return [str(name) for name in ast.literal_eval(node.value)]
    return []


@dataclass(frozen=True)
class Installed:
    """An offer of an installed package under a name.

    `entry`: an entry point of Python's, or of the package importlib_metadata, which takes Python's place once some
    library has loaded it.
    """

    entry: Any

    @property
    def description(self) -> str:
        """The package, with its version."""
        dist = self.entry.dist
        return "a package without a name" if dist is None else f"{dist.name} {dist.version}"

    @property
    def package(self) -> str:
        """The name by which Python imports it."""
        return str(self.entry.module).partition(".")[0]

    @property
    def folders(self) -> list[Path]:
        """Folders of its files; none where it is a single file. Nothing of it runs."""
        spec = find_spec(self.package)
        return [] if spec is None else [Path(place) for place in spec.submodule_search_locations or ()]

    @property
    def digest(self) -> str:
        """SHA-256 of each Python file of the package, by path; nothing of it runs. Raises SweepError without any."""
        spec = find_spec(self.package)
        files = [(path.relative_to(folder), path) for folder in self.folders for path in sorted(folder.rglob("*.py"))]
        if spec is not None and not self.folders and spec.origin is not None:
            files = [(Path(Path(spec.origin).name), Path(spec.origin))]
        if not files:
            raise SweepError(
                ValidationIssue("no such package, though it is installed", self.description, value=self.package)
            )
        digest = hashlib.sha256(self.description.encode())
        for name, path in files:
            digest.update(name.as_posix().encode() + b"\0" + hashlib.sha256(path.read_bytes()).digest())
        return digest.hexdigest()


def offers(group: Offered) -> list[str]:
    """Return the entry points that installed packages provide, without importing them."""
    return sorted({entry.name for entry in entry_points(group=group)})


def installed(group: Offered, name: str) -> Installed | None:
    """Return the entry point of a name.

    None if no package provides it. Raises SweepError if several packages provide it.
    """
    entries = {entry.value: entry for entry in entry_points(group=group) if entry.name == name}
    if len(entries) > 1:
        several = " and ".join(sorted(Installed(entry).description for entry in entries.values()))
        raise SweepError(ValidationIssue(f"{several} both offer it", value=name, allowed="one of them installed"))
    return Installed(next(iter(entries.values()))) if entries else None
