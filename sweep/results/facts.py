"""Content of `provenance.json` as typed objects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from ..base.errors import OutputError, ValidationIssue
from ..metrics.quantity import Column
from ..search.problem import CONVERGED

_MOST_SHOWN = 10
_Model = TypeVar("_Model", bound=BaseModel)


class _Facts(BaseModel):
    """Facts that a run wrote; more of them, from a later version, are no issue."""

    model_config = ConfigDict(frozen=True, extra="ignore", ser_json_inf_nan="constants")


class Origin(_Facts):
    """Source of curves."""

    name: str
    source: str
    surrogate: bool


class SensorOrigin(Origin):
    """The same of a sensor, with the curve whose light is 1: that of a pixel without filter, or the brightest one."""

    reference: str = ""
    has_clear: bool = True


class EffectFacts(_Facts):
    """An effect, computed or not, and why; a bound on its change of a CSD, DN, None where none is known."""

    effect: str
    computed: bool
    bound_dn: float | None
    reason: str


class PlanFacts(_Facts):
    """Simulation of a scene; `error_bound_dn`: all that was left out changes a CSD by no more."""

    key: str
    tolerance_dn: float
    error_bound_dn: float
    accuracy: dict[str, Any]
    effects: tuple[EffectFacts, ...]

    @property
    def computed(self) -> list[str]:
        """Effects that were computed."""
        return [choice.effect for choice in self.effects if choice.computed]


class CheckFacts(_Facts):
    """Rows of a run that were compared with the reference settings: the largest difference of a separation, and where.

    `other`: the column not in DN that differs most of what is allowed, `largest_share` by how much, relative.
    `slower`: how many times as long a design takes at the reference settings.
    """

    rows: int
    design_id: int
    scenario: str
    quantity: str
    largest_dn: float
    allowed_dn: float
    other: str = ""
    largest_share: float = 0.0
    allowed_share: float = 1.0
    slower: float

    @property
    def passed(self) -> bool:
        """True if no difference is larger than allowed, except for rounding of the arithmetic."""
        in_dn = self.largest_dn <= self.allowed_dn * (1 + 1e-9) + 1e-9
        return in_dn and self.largest_share <= self.allowed_share

    @property
    def sentence(self) -> str:
        """Result in words."""
        rows = "1 row differs" if self.rows == 1 else f"{self.rows:,} rows differ"
        where = f"{self.quantity} of design {self.design_id} in {self.scenario}"
        said = (
            f"Checked: {rows} from the reference settings by at most {self.largest_dn:.2g} DN ({where}; "
            f"allowed {self.allowed_dn:.3g} DN)"
        )
        if self.largest_share > self.allowed_share:
            said += f", and by {self.largest_share:.2%} in {self.other} (allowed {self.allowed_share:.2%})"
        return f"{said}."


class SearchFacts(_Facts):
    """A search in figures; see `search.upper_bound.UpperBound` for those of the bound.

    `scenario`: of several (`scenarios`) the one in which the answer is worst. `cfa`, `channel`: the searched ones.
    `bounded`: kind and name of the spaces whose feasible filters the limit holds for, in that scenario.
    `refinement`: the algorithm that continued from the best point of all starts; `endings` has its status at the end.
    `scenes_added`: of a series, between its scenarios, where the worst value was found. `features`: what features
    that search say.
    `upper_bound_of_box`: of filters that may exceed the replaced curve where the box does.
    """

    algorithm: str
    scenario: str
    scenarios: int = 1
    space: str
    cfa: str
    channel: str
    bounded: tuple[str, ...]
    starts: int
    evaluations: int
    endings: tuple[str, ...]
    objective: str
    best_smooth_objective: float
    best_sensitivity: float
    upper_bound_attained: float | None
    upper_bound_proven: float | None
    upper_bound_left_out: tuple[str, ...]
    upper_bound_programs: int | None
    upper_bound_open_parts: int | None
    front_upper_bounds_open: int
    gap: float | None
    no_upper_bound: str | None
    front_evaluations: int
    combinations: tuple[str, ...] = ()
    refinement: str | None = None
    scenes_added: int = 0
    features: dict[str, Any] = {}
    upper_bound_of_box: bool = False

    @property
    def converged(self) -> bool:
        """True if a start or the refinement has converged."""
        return any(ending in CONVERGED for ending in self.endings)


class Provenance(_Facts):
    """Everything needed to run a study again, the machine that ran it, and the meaning of its columns."""

    command: tuple[str, ...]
    duration_s: float
    seed: int
    fingerprint: str
    model_version: str
    data_sha256: dict[str, str]
    sensor: SensorOrigin
    lights: Origin
    versions: dict[str, str]
    platform: str
    byte_order: str
    cores: int | None
    backend: str
    scheduler: str | None
    workers: int
    threads_per_worker: int
    filters: int
    designs: int
    failed: int
    counts: tuple[tuple[str, str, str, str, bool, int], ...]
    plans: dict[str, PlanFacts]
    seconds_of_effects: tuple[float, float] | None = None
    """Time of all rows on one core as planned, and with every effect, s; where a bound leaves effects out."""
    check: CheckFacts | None = None
    trade_off: tuple[str, str]
    parameters: tuple[str, ...]
    quantities: tuple[Column, ...]
    warnings: tuple[str, ...]
    search: SearchFacts | None = None


def missing_keys(kind: type[BaseModel], facts: Mapping[str, Any]) -> list[str]:
    """Return the keys that facts lack, or have with another type."""
    try:
        kind.model_validate(facts)
    except ValidationError as error:
        return list(dict.fromkeys(".".join(map(str, issue["loc"])) for issue in error.errors()))
    return []


def checked_facts(path: Path, kind: type[_Model], facts: Mapping[str, Any]) -> _Model:
    """Convert the facts of a file to an object.

    Raises OutputError if keys are missing, with their names.
    """
    if lacks := missing_keys(kind, facts):
        raise missing_parts_error(path, lacks[:_MOST_SHOWN])
    return kind.model_validate(facts)


def missing_parts_error(path: Path, names: Sequence[str]) -> OutputError:
    """Return the error of a file with missing parts."""
    again = "delete it, and `sweep run` of the study makes it again"
    return OutputError(ValidationIssue(f"lacks {', '.join(names)}; {again}", str(path)))
