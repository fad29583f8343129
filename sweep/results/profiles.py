"""Parameter profiles: the best objective when one parameter is held at a value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from ..base.types import FloatArray
from .tables import SWEPT, word_mask

if TYPE_CHECKING:
    import pandas as pd

_KEEPS = 0.95
_MOST_VALUES, _MOST_PROFILES = 60, 9


@dataclass(frozen=True)
class ParameterProfile:
    """Best objective of all feasible designs with one parameter at a value.

    Parameters
    ----------
    parameter : str
        Name.
    values, best : ndarray of shape (n_values,)
        Values of the parameter, and best objective at each.
    """

    parameter: str
    values: FloatArray
    best: FloatArray

    @property
    def drop(self) -> float:
        """Loss of the objective at the worst value of the parameter, for the best of the other parameters."""
        return float(self.best.max() - self.best.min())

    @property
    def keeps(self) -> tuple[float, float]:
        """Range around its best value in which the parameter keeps 95 % of the best objective."""
        best = int(self.best.argmax())
        low = np.flatnonzero(self.best < _KEEPS * self.best.max())
        first = low[low < best].max(initial=-1) + 1
        last = low[low > best].min(initial=len(self.best)) - 1
        return float(self.values[first]), float(self.values[last])


@dataclass
class Profiles:
    """Profiles of swept designs in a scenario by CFA, collected from result tables."""

    objective: str
    scenario: str
    parameters: Sequence[str]
    _best: dict[tuple[str, str], pd.Series] = field(default_factory=dict)

    def add(self, table: pa.Table) -> None:
        """Add rows of the result table.

        Parameters
        ----------
        table : pyarrow.Table
            Table.
        """
        import pandas as pd  # noqa: PLC0415  (slow to import: workers do without)

        wanted = (
            word_mask(table, "kind", SWEPT) & word_mask(table, "scenario", self.scenario) & table["feasible"].to_numpy()
        )
        rows = table.select([*self.parameters, self.objective, "cfa"]).filter(pa.array(wanted)).to_pandas()
        for name in self.parameters:
            bests = rows.dropna(subset=[name]).groupby(["cfa", name], observed=True)[self.objective].max()
            for cfa in bests.index.unique("cfa"):
                best = bests.loc[cfa]
                if (cfa, name) in self._best:
                    best = pd.concat([self._best[cfa, name], best]).groupby(level=0).max()
                self._best[cfa, name] = _binned(best)

    @property
    def found(self) -> dict[str, list[ParameterProfile]]:
        """Profiles of the parameters with the largest effect, by CFA."""
        profiles: dict[str, list[ParameterProfile]] = {}
        for (cfa, name), best in self._best.items():
            if len(best) > 1:
                profile = ParameterProfile(name, best.index.to_numpy(dtype=float), best.to_numpy(dtype=float))
                profiles.setdefault(str(cfa), []).append(profile)
        return {cfa: sorted(made, key=lambda p: -p.drop)[:_MOST_PROFILES] for cfa, made in profiles.items()}


def _binned(best: pd.Series) -> pd.Series:
    """Return the best value in each of equal parts of the range, if there are many values."""
    if len(best) <= _MOST_VALUES:
        return best
    values = best.index.to_numpy(dtype=float)
    part = np.floor((values - values.min()) / np.ptp(values) * _MOST_VALUES).clip(max=_MOST_VALUES - 1)
    return best.loc[best.groupby(part).idxmax().to_numpy()]


def profile_table(profiles: Sequence[ParameterProfile]) -> pd.DataFrame:
    """Return the profiles in figures.

    Parameters
    ----------
    profiles : sequence of ParameterProfile
        Profiles.

    Returns
    -------
    pandas.DataFrame
        One row per parameter.
    """
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
