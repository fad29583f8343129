"""The spectra that the package ships, with the data card of each set."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from ..curves.builtin.spectra import Card, cards
from ..curves.builtin.stand_ins import surrogate_cards


def data_lines() -> list[str]:
    """For each set: what it is and who may use it, its groups, its source and credit, and the digest of its numbers."""
    found = [*cards(), *surrogate_cards()]
    total = sum(sum(card.groups.values()) for card in found)
    lines = [line for card in found for line in _lines(card)]
    return [*lines, f"{total} spectra in {len(found)} sets. A study's tasks name their groups: tasks: {{own: ...}}."]


def data_facts() -> dict[str, Any]:
    """The same as plain values."""
    return {"sets": [asdict(card) for card in (*cards(), *surrogate_cards())]}


def _lines(card: Card) -> Iterator[str]:
    count = sum(card.groups.values())
    how = "surrogate: modeled, not measured" if card.surrogate else "as published"
    yield f"{card.name}: {count} {card.kind}s, {card.first_nm:g} to {card.last_nm:g} nm, {card.license}, {how}"
    yield f"  groups: {', '.join(f'{group} ({size})' for group, size in card.groups.items())}"
    yield f"  source: {card.source}"
    yield f"  credit: {card.credit}"
    yield f"  sha256: {card.sha256}"
