"""How each effect of the image chain is computed."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import make_dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

from ..base.errors import Fault, SweepError, nearest
from .registry import EFFECTS


class Methods(make_dataclass("_Methods", [(name, str) for name in EFFECTS], init=False, frozen=True)):  # type: ignore[misc]
    """The method of each effect by its name; what is not named, as in the reference, with everything on.

    Raises SweepError for an effect or a method that does not exist.
    """

    if TYPE_CHECKING:

        def __getattr__(self, effect: str) -> str:
            """The method of an effect."""

    def __init__(self, **methods: str) -> None:
        _refuse_unknown("effect", methods, EFFECTS)
        for name, effect in EFFECTS.items():
            method = methods.get(name, effect.methods[-1])
            if method not in effect.methods:
                _refuse_unknown(f"method of {name}", (method,), effect.methods)
            object.__setattr__(self, name, method)

    @property
    def straight(self) -> bool:
        """Whether digital numbers are linear in electrons: neither clipped nor rounded."""
        return all(getattr(self, effect.name) == effect.off for effect in EFFECTS.values() if effect.bends)


def _refuse_unknown(what: str, names: Iterable[str], known: Collection[str]) -> None:
    for name in names:
        if name not in known:
            raise SweepError(
                Fault(f"unknown {what}", value=name, allowed=", ".join(known), nearest=nearest(name, known))
            )


@lru_cache(maxsize=65_536)
def switched(methods: Methods, effect: str, method: str) -> Methods:
    """The methods with another one of an effect, remembered: a search for a plan asks for the same ones again."""
    return replace(methods, **{effect: method})


REFERENCE = Methods()
