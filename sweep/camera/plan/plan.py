"""What was found of which effects a scene calls for: a method for each, and what it may change."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from functools import cached_property

from ..methods import Methods
from ..registry import EFFECTS

NOT_ASKED = "to find out whether it matters takes longer"
"""Why an effect is on without a look at what it changes."""


@dataclass(frozen=True)
class Choice:
    """One effect of a plan: its method, what that changes in any CSD at most (DN), and why."""

    effect: str
    method: str
    promised_dn: float
    reason: str


@dataclass(frozen=True)
class Plan:
    """How one scene is simulated; `work` estimates the seconds of all designs (see `work`), `reference_work` those of
    everything on.

    Everything on is a mathematical limit. What no method reaches (the last of all places of a light, and how a readout
    in whole numbers moves the worst of them) is part of every promise, so that `promised_dn` may be above
    `tolerance_dn`: all else keeps the tolerance then.
    """

    scenario: str
    tolerance_dn: float
    choices: tuple[Choice, ...]
    work: float
    reference_work: float
    rejected: tuple[tuple[str, str, float], ...] = ()

    @property
    def methods(self) -> Methods:
        """The methods, as a view takes them."""
        return Methods(**{choice.effect: choice.method for choice in self.choices})

    @property
    def promised_dn(self) -> float:
        """No CSD differs by more from the reference."""
        return sum(choice.promised_dn for choice in self.choices)

    @property
    def kept(self) -> bool:
        """Whether the tolerance is kept."""
        return self.promised_dn <= self.tolerance_dn

    @cached_property
    def key(self) -> str:
        """Hash of the methods: part of every cache key, and in every row."""
        return hashlib.sha256(json.dumps(asdict(self.methods), sort_keys=True).encode()).hexdigest()[:12]

    @property
    def computed(self) -> tuple[str, ...]:
        """Effects that are not skipped."""
        return tuple(c.effect for c in self.choices if c.method != EFFECTS[c.effect].off)
