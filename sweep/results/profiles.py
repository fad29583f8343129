"""What each parameter may be: the best objective that is left when one parameter is held at a value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from ..base.types import FloatArray
from .tables import holds

if TYPE_CHECKING:
    import pandas as pd

_KEEPS = 0.95
_MOST_PLACES, _MOST_PROFILES = 60, 9


@dataclass(frozen=True)
class ParameterProfile:
    """The best objective of all feasible designs that have one parameter at a value: ndarray[n_values] each."""

    parameter: str
    values: FloatArray
    best: FloatArray

    @property
    def drop(self) -> float:
        """How much of the objective the worst value of the parameter costs, whatever the others are."""
        return float(self.best.max() - self.best.min())

    @property
    def keeps(self) -> tuple[float, float]:
        """From where to where, around its best value, the parameter keeps 95 % of the best objective."""
        enough = self.best >= _KEEPS * self.best.max()
        first = last = int(self.best.argmax())
        while first > 0 and enough[first - 1]:
            first -= 1
        while last < len(enough) - 1 and enough[last + 1]:
            last += 1
        return float(self.values[first]), float(self.values[last])


@dataclass
class Profiles:
    """Collects profiles of swept designs in a scenario, by CFA, from tables of results."""

    objective: str
    scenario: str
    parameters: Sequence[str]
    _best: dict[str, dict[str, pd.Series]] = field(default_factory=dict)

    def add(self, table: pa.Table) -> None:
        """Take in some rows of the result table."""
        wanted = holds(table, "kind", "sweep") & holds(table, "scenario", self.scenario)
        feasible = table.select([*self.parameters, self.objective, "cfa"]).filter(
            pa.array(wanted & table["feasible"].to_numpy())
        )
        for cfa, rows in feasible.to_pandas().groupby("cfa", observed=True):
            self._take(str(cfa), rows)

    def _take(self, cfa: str, rows: pd.DataFrame) -> None:
        import pandas as pd  # noqa: PLC0415  (slow to import: workers do without)

        mine = self._best.setdefault(cfa, {})
        for name in self.parameters:
            own = rows.dropna(subset=[name])
            if own.empty:
                continue
            best = own.groupby(name)[self.objective].max()
            if name in mine:
                best = pd.concat([mine[name], best]).groupby(level=0).max()
            mine[name] = _places(best)

    @property
    def found(self) -> dict[str, list[ParameterProfile]]:
        """CFA -> profiles of the parameters that matter most, of those that have more than one value."""
        made = {
            cfa: [
                ParameterProfile(name, best.index.to_numpy(dtype=float), best.to_numpy(dtype=float))
                for name, best in mine.items()
                if len(best) > 1
            ]
            for cfa, mine in self._best.items()
        }
        return {cfa: sorted(found, key=lambda p: -p.drop)[:_MOST_PROFILES] for cfa, found in made.items() if found}


def _places(best: pd.Series) -> pd.Series:
    """The same, of many values the best one in each of equal parts of their range."""
    if len(best) <= _MOST_PLACES:
        return best
    values = best.index.to_numpy(dtype=float)
    part = np.floor((values - values.min()) / np.ptp(values) * _MOST_PLACES).clip(max=_MOST_PLACES - 1)
    kept = best.groupby(part).idxmax()
    return best.loc[kept.to_numpy()]


def profile_table(profiles: Sequence[ParameterProfile]) -> pd.DataFrame:
    """What each parameter's value matters, in figures."""
    import pandas as pd  # noqa: PLC0415  (slow to import: workers do without)

    return pd.DataFrame(
        [
            {
                "parameter": p.parameter,
                "best at": p.values[p.best.argmax()],
                "keeps 95 % from": p.keeps[0],
                "to": p.keeps[1],
                "best objective at its worst value": round(float(p.best.min()), 1),
            }
            for p in profiles
        ]
    )
