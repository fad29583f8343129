"""How several weighted quantities become one number that a search maximizes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar, Literal

from ..base.types import FloatArray


class Rule(ABC):
    """A rule that never gets worse where one of its terms gets better. A file in `metrics/rules/` holds one.

    `name`: its key in a study. `wanted`: whether more of its terms is better, or less. `smallest`: whether it is as
    good as its worst term, which a search bounds from below by one number, and a limit can be proven of.
    """

    name: ClassVar[str]
    wanted: ClassVar[Literal["more", "less"]] = "more"
    smallest: ClassVar[bool] = False

    @abstractmethod
    def of(self, terms: FloatArray) -> FloatArray:
        """The objective, ndarray[...]; `terms`: weight times quantity, >= 0, ndarray[n_terms, ...]."""

    @abstractmethod
    def gradient(self, terms: FloatArray) -> FloatArray:
        """Its derivative by each term, ndarray[n_terms], >= 0 where more is wanted; `terms`: ndarray[n_terms]."""

    @abstractmethod
    def words(self, terms: Sequence[str]) -> str:
        """The objective in words, of terms in words: two or more, or one of which less is wanted."""
