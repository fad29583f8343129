"""Simulation of each scene: effects computed and left out, the bound on what that changes, and measured errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from ..results.facts import EffectFacts
from ..results.output import Output


@dataclass(frozen=True)
class SceneGroup:
    """Scenes of which the same effects were computed.

    `realized_dn`: the largest error that an audit found, None without one.
    """

    scenarios: tuple[str, ...]
    effects: tuple[EffectFacts, ...]
    error_bound_dn: float
    realized_dn: float | None
    tolerance_dn: float

    @property
    def title(self) -> str:
        """The scenes in a few words."""
        first, last = self.scenarios[0], self.scenarios[-1]
        return first if first == last else f"{first} ... {last} ({len(self.scenarios)} scenes)"

    @property
    def computed(self) -> str:
        """Effects that were computed."""
        return ", ".join(each.effect for each in self.effects if each.computed)


def scene_groups(output: Output) -> list[SceneGroup]:
    """All scenes, those with the same effects together, each effect with its largest bound among them."""
    plans = output.provenance.plans
    groups: dict[tuple[str, ...], list[str]] = {}
    for name, plan in plans.items():
        groups.setdefault(tuple(plan.computed), []).append(name)
    result = []
    for names in groups.values():
        alike = [plans[name] for name in names]
        effects = (
            max(choices, key=lambda each: each.bound_dn or 0.0)
            for choices in zip(*(plan.effects for plan in alike), strict=True)
        )
        bound_dn = max(plan.error_bound_dn for plan in alike)
        realized_dn, tolerance_dn = _realized(output, names), alike[0].tolerance_dn
        result.append(SceneGroup(tuple(names), tuple(effects), bound_dn, realized_dn, tolerance_dn))
    return result


def _realized(output: Output, names: list[str]) -> float | None:
    if output.audited is None:
        return None
    audited = output.audited[output.audited["scenario"].isin(names)]
    return float(audited["realized_dn"].max()) if len(audited) else None


def scene_table(groups: Sequence[SceneGroup]) -> pd.DataFrame:
    """Effects of each group of scenes, the bound on the others, and the error that an audit found."""
    return pd.DataFrame(
        [
            {
                "scenes": group.title,
                "computed": group.computed,
                "bound on what is left out / DN": f"{group.error_bound_dn:.2g}",
                "error / DN": "not audited" if group.realized_dn is None else f"{group.realized_dn:.2g}",
                "tolerance / DN": f"{group.tolerance_dn:g}",
            }
            for group in groups
        ]
    )


def effect_table(group: SceneGroup) -> pd.DataFrame:
    """Every effect, whether it is computed, its bound and reason."""
    return pd.DataFrame(
        [
            {
                "effect": each.effect,
                "computed": "computed" if each.computed else "left out",
                "bound / DN": "none" if each.bound_dn is None else f"{each.bound_dn:.2g}",
                "reason": each.reason,
            }
            for each in group.effects
        ]
    )
