"""Code that a study names: allowed or refused, found, read and digested; nothing of it runs here."""

from __future__ import annotations

from collections.abc import Iterable

from ..disk import is_file
from ..errors import Fault, SweepError
from ..own_code import CODE_OF, Offered, OwnCode, file_of, installed, is_in_file, offers, read_code
from .sources import Sources
from .yaml_tree import Key


def is_from_outside(name: str, group: Offered, known: Iterable[str]) -> bool:
    """Whether a name is that of code that is not the package's, whose own names come first."""
    return is_in_file(name) or (name not in known and name in offers(group))


def allowed(sources: Sources, path: tuple[Key, ...], name: str) -> bool:
    """Whether code may run; else adds a fault."""
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
    found = next((folder / file for folder in sources.folders if is_file(folder / file)), None)
    if found is None:
        searched = ", ".join(str(folder) for folder in sources.folders)
        raise SweepError(Fault("no such file", value=file, allowed=f"a path relative to {searched}"))
    source, digest = read_code(found)
    _digested(sources, file, digest)
    return OwnCode(name, source)


def _digested(sources: Sources, name: str, digest: str) -> None:
    """Note the digest; raises SweepError where only other code may run."""
    if not isinstance(sources.allow_code, bool) and sources.allow_code.get(name) != digest:
        raise SweepError(Fault("not the code that the run had", value=name))
    sources.digests[name] = digest
