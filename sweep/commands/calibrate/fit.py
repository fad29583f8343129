"""One bounded least-squares fit: published figures, priors, smoothness, color regions, ranking."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from ...base.types import FloatArray
from ...curves.builtin.surrogate import SurrogateParameters
from .model import DISTANCES, Figures, color_violations, crossed_edges, figures
from .parameters import Free, Path, checked, free_parameters, with_values

CSD_RELATIVE = 0.005
"""How exactly a printed CSD is asked for, beside its rounding: the model's own error, half a percent."""
CSD_ROUNDING_DN = 1 / np.sqrt(12)
SENSITIVITY_SIGMA = 0.0005
_SMOOTH = 0.03
"""Standard deviation of the clear pixel's second differences (per 50 nm) around those of its prior."""
_COLOR_MARGIN = 0.001
_ORDER_MARGIN_DN = 2.0
_ORDER_SIGMA_DN = 0.3
_EDGE_MARGIN_NM, _EDGE_SIGMA_NM = 0.5, 0.1
_START_SPREAD = 0.7
_DECIMALS = 4
MOST_EVALUATIONS = 120
"""Of a fit, each with those of its derivatives."""


@dataclass(frozen=True)
class Task:
    """What a fit sees: `targets` (row -> quantity -> printed value), which stopband parameters move, which are tied."""

    prior: Mapping[str, Any]
    targets: Figures
    stopbands: tuple[str, ...]
    tied: Mapping[Path, Path] = field(default_factory=dict)

    @property
    def free(self) -> list[Free]:
        """The free parameters."""
        return free_parameters(self.prior, self.stopbands)


@dataclass(frozen=True)
class Fit:
    """A finished fit: the parameter tree (rounded as it is shipped), its cost, and how sure each parameter is.

    `certainty`: posterior over prior standard deviation of each free parameter; 1 means that it stayed a guess.
    `singular_values`: of the figures' Jacobian in units of the priors; each above 1 is a direction that they determine.
    """

    tree: Mapping[str, Any]
    cost: float
    evaluations: int
    certainty: Mapping[str, float]
    at_bound: tuple[str, ...]
    singular_values: FloatArray

    @property
    def parameters(self) -> SurrogateParameters:
        """The parameters that the package builds curves from."""
        return checked(self.tree)


class _Residuals:
    """All residuals of a task in one vector, each in units of its standard deviation; the figures come first."""

    def __init__(self, task: Task) -> None:
        self.task = task
        self.free = task.free
        self.mean = np.array([f.mean for f in self.free])
        self.sigma = np.array([f.sigma for f in self.free])
        self.keys = [(row, quantity) for row, values in task.targets.items() for quantity in values]
        self.printed = np.array([task.targets[row][quantity] for row, quantity in self.keys])
        self.tolerance = np.array(
            [
                SENSITIVITY_SIGMA if quantity == "sensitivity" else np.hypot(CSD_ROUNDING_DN, CSD_RELATIVE * value)
                for (_, quantity), value in zip(self.keys, self.printed, strict=True)
            ]
        )
        self.ordered = [(row, a, b) for row, values in task.targets.items() for a, b in printed_order(values)]

    def __call__(self, x: FloatArray) -> FloatArray:
        parameters = checked(with_values(self.task.prior, self.free, x, self.task.tied))
        found = figures(parameters, list(self.task.targets))
        data = (np.array([found[row][quantity] for row, quantity in self.keys]) - self.printed) / self.tolerance
        bend = np.diff(np.array(parameters.clear_pixel.qe) - self.task.prior["clear_pixel"]["qe"], 2) / _SMOOTH
        color = np.maximum(0, color_violations(parameters) + _COLOR_MARGIN) / _COLOR_MARGIN
        order = [
            max(0.0, found[row][a] - found[row][b] + _ORDER_MARGIN_DN) / _ORDER_SIGMA_DN for row, a, b in self.ordered
        ]
        crossed = np.maximum(0, crossed_edges(parameters) + _EDGE_MARGIN_NM) / _EDGE_SIGMA_NM
        return np.concatenate([data, (x - self.mean) / self.sigma, bend, color, order, crossed])


def printed_order(values: Mapping[str, float]) -> list[tuple[str, str]]:
    """Neighbors of the printed ranking of a row's CSDs, smaller first; ties are left out."""
    names = sorted((name for name in values if name in DISTANCES), key=lambda name: values[name])
    return [(a, b) for a, b in itertools.pairwise(names) if values[a] < values[b]]


def fit_from(task: Task, seed: int, start: int, most_evaluations: int = MOST_EVALUATIONS) -> Fit:
    """Fit from the prior's mean (start 0) or from a draw of the prior; the same for the same seed and start."""
    residuals = _Residuals(task)
    low, high = (np.array([getattr(f, end) for f in residuals.free]) for end in ("low", "high"))
    draw = np.random.default_rng([seed, start]).normal(size=low.size) * _START_SPREAD * (start > 0)
    inside = 1e-6 * residuals.sigma
    x0 = np.clip(residuals.mean + draw * residuals.sigma, low + inside, high - inside)
    found = least_squares(
        residuals, x0, bounds=(low, high), x_scale=residuals.sigma, max_nfev=most_evaluations, xtol=1e-7, ftol=1e-7
    )
    x = np.clip(np.round(found.x, _DECIMALS), low, high)
    names = [f.name for f in residuals.free]
    jacobian = found.jac
    posterior = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    data = jacobian[: len(residuals.keys)] * residuals.sigma
    near = np.minimum(x - low, high - x) < 1e-3 * residuals.sigma
    return Fit(
        tree=with_values(task.prior, residuals.free, x, task.tied),
        cost=float(found.cost),
        evaluations=int(found.nfev),
        certainty=dict(zip(names, (posterior / residuals.sigma).tolist(), strict=True)),
        at_bound=tuple(name for name, close in zip(names, near, strict=True) if close),
        singular_values=np.linalg.svd(data, compute_uv=False),
    )


def best_of(fits: Sequence[Fit]) -> Fit:
    """The fit with the lowest cost; the earlier one on a tie."""
    return min(fits, key=lambda fit: fit.cost)
