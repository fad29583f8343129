"""How each scene was simulated, what that may change and did change, and what it saved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from ..results.facts import EffectFacts
from ..results.output import Output

_LEAST_S = 1e-6


@dataclass(frozen=True)
class SceneGroup:
    """Scenes that were simulated by the same methods. `effects`: rows of effect, method, promised error, reason.

    `realized_dn`: the largest error that an audit found, None without one; `work`: estimated seconds, `whole_work`:
    those with every effect on.
    """

    scenarios: tuple[str, ...]
    effects: tuple[EffectFacts, ...]
    promised_dn: float
    realized_dn: float | None
    tolerance_dn: float
    work: float
    whole_work: float

    @property
    def title(self) -> str:
        """The scenes in a few words."""
        first, last = self.scenarios[0], self.scenarios[-1]
        return first if first == last else f"{first} ... {last} ({len(self.scenarios)} scenes)"

    @property
    def computed(self) -> str:
        """Effects that were computed."""
        return ", ".join(each.effect for each in self.effects if each.is_computed)


def scene_groups(output: Output) -> list[SceneGroup]:
    """All scenes, those with the same methods together, each effect with its largest promise among them."""
    plans = output.provenance.plans
    groups: dict[tuple[tuple[str, str], ...], list[str]] = {}
    for name, plan in plans.items():
        groups.setdefault(tuple((each.effect, each.method) for each in plan.effects), []).append(name)
    found = []
    for names in groups.values():
        own = [plans[name] for name in names]
        effects = (
            max(choices, key=lambda each: each.promised_dn)
            for choices in zip(*(plan.effects for plan in own), strict=True)
        )
        found.append(
            SceneGroup(
                tuple(names),
                tuple(effects),
                max(plan.promised_dn for plan in own),
                _realized(output, names),
                own[0].tolerance_dn,
                sum(plan.work for plan in own),
                sum(plan.reference_work for plan in own),
            )
        )
    return found


def _realized(output: Output, names: list[str]) -> float | None:
    if output.audited is None:
        return None
    own = output.audited[output.audited["scenario"].isin(names)]
    return float(own["realized_dn"].max()) if len(own) else None


def scene_table(groups: Sequence[SceneGroup]) -> pd.DataFrame:
    """What each group of scenes promises, what an audit found, and what the methods save."""
    return pd.DataFrame(
        [
            {
                "scenes": group.title,
                "computed": group.computed,
                "promised / DN": f"{group.promised_dn:.2g}",
                "realized / DN": "not audited" if group.realized_dn is None else f"{group.realized_dn:.2g}",
                "tolerance / DN": f"{group.tolerance_dn:g}",
                "estimated / s": f"{group.work:.2g}",
                "with everything on / s": f"{group.whole_work:.2g}",
                "times less": f"{group.whole_work / max(group.work, _LEAST_S):.3g}",
            }
            for group in groups
        ]
    )


def effect_table(group: SceneGroup) -> pd.DataFrame:
    """Every effect's method, promise and reason."""
    return pd.DataFrame(
        [
            {
                "effect": each.effect,
                "method": each.method,
                "promised / DN": f"{each.promised_dn:.2g}",
                "reason": each.reason,
            }
            for each in group.effects
        ]
    )
