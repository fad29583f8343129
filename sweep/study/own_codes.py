"""Code that a study names and that is not the package's: allowed or refused, located, read and digested."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeVar

from pydantic import ValidationError

from ..base.disk import is_file
from ..base.errors import Fault, StudyError, SweepError
from ..base.own_code import CODE_OF, Installed, Offered, OwnCode, file_of, installed, is_in_file, offers, read_code
from .schema_curves import LightsSection, SensorSection
from .sources import Sources
from .yaml_tree import Key

_Curves = TypeVar("_Curves", SensorSection, LightsSection)


def is_from_outside(name: str, group: Offered, known: Iterable[str]) -> bool:
    """Return whether a name is that of code that is not the package's, whose own names come first."""
    return is_in_file(name) or (name not in known and name in offers(group))


def allowed(sources: Sources, path: tuple[Key, ...], name: str) -> bool:
    """Return whether code may run; else adds a fault."""
    if not sources.allow_code:
        whose = "a Python file" if is_in_file(name) else "what an installed package offers"
        problem = f"the study names {whose}, whose code would run"
        sources.add(path, problem, name, "--allow-code, if you trust it")
    return bool(sources.allow_code)


def code_of(sources: Sources, name: str, group: Offered) -> OwnCode:
    """Code that is allowed, with its digest in that of the study's files. Raises SweepError where there is none."""
    if not is_in_file(name):
        offer = installed(group, name)
        if offer is None:
            raise SweepError(Fault("no installed package offers it", value=name))
        digest = offer.digest
        _digested(sources, f"{CODE_OF}{offer.told} ({group}: {name})", digest)
        return OwnCode(name, None, group, digest)
    file = file_of(name)
    place = next((folder / file for folder in sources.folders if is_file(folder / file)), None)
    if place is None:
        searched = ", ".join(str(folder) for folder in sources.folders)
        raise SweepError(Fault("no such file", value=file, allowed=f"a path relative to {searched}"))
    source, digest = read_code(place)
    _digested(sources, file, digest)
    return OwnCode(name, source)


def _digested(sources: Sources, name: str, digest: str) -> None:
    """Note the digest; raises SweepError where only other code may run."""
    if not isinstance(sources.allow_code, bool) and sources.allow_code.get(name) != digest:
        raise SweepError(Fault("not the code that the run had", value=name))
    sources.digests[name] = digest


def offered_curves(
    sources: Sources, at: tuple[Key, ...], section: _Curves, group: Offered, known: Iterable[str]
) -> _Curves:
    """The section as a package says it, with what the study adds to it; itself where it names none of a package.

    A package offers what a study would say: a mapping with `files`, which lie in the package, or a function that
    returns one. Raises StudyError where that cannot be had: the name is then that of nothing.
    """
    name = section.builtin
    if name is None or not is_from_outside(name, group, known):
        return section
    if not allowed(sources, at, name):
        raise StudyError(sources.faults)
    try:
        made: _Curves = type(section).model_validate(_said(code_of(sources, name, group)))
        offer: Installed | None = installed(group, name)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        sources.add(at, f"what a package offers is no such section: {where}: {first['msg']}", name)
        raise StudyError(sources.faults) from None
    except SweepError as error:
        sources.told(at, error)
        raise StudyError(sources.faults) from None
    sources.folders = [*([] if offer is None else offer.folders), *sources.folders]
    stated = {key: getattr(section, key) for key in section.model_fields_set - {"builtin", "files"}}
    files = {"files": [*made.files, *section.files]}
    return made.model_copy(update={"name": made.name or name, **files, **stated})


def _said(code: OwnCode) -> dict[str, object]:
    """Curves as a package states them. Raises SweepError where it says nothing."""
    loaded = code.loaded
    said = code.called(loaded) if callable(loaded) else loaded
    if not isinstance(said, Mapping) or said.get("builtin") == code.name:
        raise SweepError(Fault(f"{code.name} says nothing of curves", value=said, allowed="a mapping with `files`"))
    return dict(said)
