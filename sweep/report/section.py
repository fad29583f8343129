"""What one section of a page says: sentences, at most one picture and one table."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import pandas as pd

from ..results.output import Output
from .pages import rows
from .panels import Picture

MOST_ROWS = 12
"""Rows of a table on a page; the Parquet file beside it has all."""


@dataclass(frozen=True)
class Table:
    """Cells as text; a cell may end in `▲ gain`, `▼ loss` or `same`. `bold`: the column of the design that answers."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""
    bold: int = -1
    optional: int = -1


class Section(ABC):
    """One question of a page with its data as plain values, made of a run by `of`.

    `leads`: whether its sentences may answer the study's question above the first picture.
    """

    heading: ClassVar[str]
    leads: ClassVar[bool] = False

    @classmethod
    @abstractmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield the sections that a run calls for."""

    @property
    def title(self) -> str:
        """What stands above it."""
        return self.heading

    @property
    def answer(self) -> list[str]:
        """Sentences; `**` around the numbers that decide."""
        return []

    @property
    def short(self) -> str:
        """What it says where another section answers: by default its first sentence."""
        return next(iter(self.answer), "")

    @property
    def limits(self) -> list[str]:
        """What limits it, a sentence each."""
        return []

    @property
    def picture(self) -> Picture | None:
        """What it shows."""
        return None

    @property
    def table(self) -> Table | None:
        """Its numbers."""
        return None


@dataclass(frozen=True)
class Told(Section):
    """A section whose words, picture and table are given."""

    words: str
    sentences: tuple[str, ...] = ()
    shown: Picture | None = None
    cells: Table | None = None

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:  # noqa: ARG003
        """Yield none: no run has one by itself."""
        yield from ()

    @property
    def title(self) -> str:
        """What stands above it."""
        return self.words

    @property
    def answer(self) -> list[str]:
        """What it says."""
        return [*self.sentences]

    @property
    def picture(self) -> Picture | None:
        """What it shows."""
        return self.shown

    @property
    def table(self) -> Table | None:
        """Its numbers."""
        return self.cells


def table_of(frame: pd.DataFrame, note: str = "", most: int = MOST_ROWS) -> Table | None:
    """Return the first rows of a data frame as text; None where it is empty."""
    cells = rows(frame)
    if not cells:
        return None
    head, *body = cells
    more = f"{len(body) - most} more rows stand in the file. " if len(body) > most else ""
    return Table(tuple(head), tuple(tuple(row) for row in body[:most]), f"{more}{note}".strip())
