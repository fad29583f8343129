"""Rules that combine several weighted quantities to one objective."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar, Literal

from ..base.types import Array, Float, PerTerm, SameShape


class Rule(ABC):
    """Rule that never gets worse where one of its terms gets better; a class in `metrics/rules/`.

    `name` is its key in a study, `wanted` states whether more of its terms is better, or less, and `smallest` whether
    it equals its worst term, so that a search bounds it by one number and an upper bound exists.
    """

    name: ClassVar[str]
    direction: ClassVar[Literal["more", "less"]] = "more"
    smallest: ClassVar[bool] = False

    @abstractmethod
    def of(self, terms: Float[Array, " terms *batch"]) -> SameShape:
        """Return the objective.

        Parameters
        ----------
        terms : ndarray of shape (n_terms, ...)
            Weight times quantity, >= 0.

        Returns
        -------
        ndarray of shape (...)
            Objective.
        """

    @abstractmethod
    def gradient(self, terms: PerTerm) -> PerTerm:
        """Return the derivative by each term.

        Parameters
        ----------
        terms : ndarray of shape (n_terms,)
            Weight times quantity, >= 0.

        Returns
        -------
        ndarray of shape (n_terms,)
            Derivatives, >= 0 if more is wanted.
        """

    @abstractmethod
    def words(self, terms: Sequence[str]) -> str:
        """Return the objective in words.

        Parameters
        ----------
        terms : sequence of str
            Terms in words.

        Returns
        -------
        str
            Text.
        """
