"""Simulation of each scene: effects computed and left out, their bound, and measured errors."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import pandas as pd

from ..camera.plan import Choice, Plan
from ..results.facts import EffectFacts
from ..results.output import Output
from ..study import Study
from .pages import aligned


@dataclass(frozen=True)
class SceneGroup:
    """Scenes with the same computed effects; `realized_dn` is the largest error of an audit, NaN without one."""

    scenarios: tuple[str, ...]
    effects: tuple[EffectFacts, ...]
    error_bound_dn: float
    realized_dn: float
    tolerance_dn: float

    @property
    def title(self) -> str:
        """Scenes in a few words."""
        return format_scenes(self.scenarios)

    @property
    def computed(self) -> str:
        """Effects that were computed."""
        return ", ".join(effect.effect for effect in self.effects if effect.computed)


def format_scenes(names: Sequence[str]) -> str:
    """Return scenes in a few words."""
    return names[0] if len(names) == 1 else f"{names[0]} ... {names[-1]} ({len(names)} scenes)"


def scene_groups(output: Output) -> list[SceneGroup]:
    """Return all scenes, grouped by computed effects, each effect with its largest bound."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for name, plan in output.provenance.plans.items():
        groups.setdefault(tuple(plan.computed), []).append(name)
    result = []
    for names in groups.values():
        plans = [output.provenance.plans[name] for name in names]
        effects = (
            max(choices, key=lambda choice: choice.bound_dn or 0.0)
            for choices in zip(*(plan.effects for plan in plans), strict=True)
        )
        bound_dn, realized_dn = max(plan.error_bound_dn for plan in plans), math.nan
        if output.audited is not None:
            realized_dn = float(output.audited.loc[output.audited["scenario"].isin(names), "realized_dn"].max())
        result.append(SceneGroup(tuple(names), tuple(effects), bound_dn, realized_dn, plans[0].tolerance_dn))
    return result


def scene_table(groups: Sequence[SceneGroup]) -> pd.DataFrame:
    """Return the effects of each group, the bound on the others, and the error of an audit."""
    rows = [
        {
            "scenes": group.title,
            "computed": group.computed,
            "bound on what is left out / DN": f"{group.error_bound_dn:.2g}",
            "error / DN": "not audited" if math.isnan(group.realized_dn) else f"{group.realized_dn:.2g}",
            "tolerance / DN": f"{group.tolerance_dn:g}",
        }
        for group in groups
    ]
    return pd.DataFrame(rows)


def effect_table(effects: Sequence[EffectFacts | Choice]) -> pd.DataFrame:
    """Return every effect with its bound and reason."""
    rows = [
        {
            "effect": effect.effect,
            "computed": "computed" if effect.computed else "left out",
            "bound / DN": "none" if effect.bound_dn is None else f"{effect.bound_dn:.2g}",
            "reason": effect.reason,
        }
        for effect in effects
    ]
    return pd.DataFrame(rows)


def plan_lines(study: Study) -> Iterator[str]:
    """Yield the effects of every scene with bound and reason; scenes of one plan together."""
    groups: dict[str, list[Plan]] = {}
    for plan in study.plans.values():
        groups.setdefault(plan.key, []).append(plan)
    for plans in groups.values():
        left_out_dn = max(plan.error_bound_dn for plan in plans)
        yield (
            f"{format_scenes([plan.scenario for plan in plans])}: what is left out changes a CSD by at most "
            f"{left_out_dn:.2g} DN (tolerance {plans[0].tolerance_dn:g} DN)"
        )
        effects = zip(*(plan.choices for plan in plans), strict=True)
        largest = [max(choices, key=lambda choice: choice.bound_dn or 0.0) for choices in effects]
        yield from (f"  {line}" for line in aligned(effect_table(largest)))
        yield ""
    settings = ", ".join(f"{name} {value}" for name, value in study.section.accuracy.model_dump().items())
    yield f"{len(study.plans)} scenes, {len(groups)} different plans. Accuracy: {settings}."


def plan_facts(study: Study) -> dict[str, Any]:
    """Return accuracy, and tolerance, error bound (DN) and effects of each scene."""
    scenes = {
        name: {
            "tolerance_dn": plan.tolerance_dn,
            "error_bound_dn": plan.error_bound_dn,
            "effects": [asdict(choice) for choice in plan.choices],
        }
        for name, plan in study.plans.items()
    }
    return {"study": study.name, "accuracy": study.section.accuracy.model_dump(), "scenarios": scenes}
