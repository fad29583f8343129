"""What the calibration may move, how far, and where it starts."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.types import FloatArray
from ...curves.builtin.surrogate import SurrogateParameters

Path = tuple[str | int, ...]


@dataclass(frozen=True)
class Free:
    """A free parameter: where it stands in the file, its prior (mean and standard deviation), its bounds."""

    path: Path
    mean: float
    sigma: float
    low: float
    high: float

    @property
    def name(self) -> str:
        """Dotted path."""
        return ".".join(map(str, self.path))


# Standard deviation of the prior, and half width of the bounds, by the last key of a parameter's path. Widths and decay
# lengths come from the spread of measured LEDs and of published dye filters; the bounds keep curves physical.
_SPREAD = {
    "qe": (0.05, 0.25),
    "peak": (0.08, 0.25),
    "leak": (0.03, 0.15),
    "center_nm": (10.0, 35.0),
    "width_nm": (10.0, 40.0),
    "peak_nm": (2.0, 5.0),
    "spread_nm": (1.5, 4.0),
    "blue_nm": (1.0, 4.0),
    "red_nm": (1.0, 4.0),
    "left_nm": (8.0, 25.0),
    "left_width_nm": (10.0, 35.0),
    "right_nm": (8.0, 25.0),
    "right_width_nm": (6.0, 14.0),
    "photon_ratio": (0.01, 0.04),
}
_OWN_SPREAD = {"ir_cut.center_nm": (4.0, 8.0)}
_FLOOR = {"leak": 0.0, "spread_nm": 0.0, "width_nm": 8.0, "left_width_nm": 5.0, "right_width_nm": 3.0}
_CEILING = {"qe": 0.95, "peak": 1.0}


def free_parameters(prior: Mapping[str, Any], stopbands: Sequence[str]) -> list[Free]:
    """Everything that may move, in the order of the file; of the stopbands only the parameters in `stopbands`.

    An entry of `stopbands` is `<filter>.<parameter>`, such as `RYN_1Cy.left_nm`.
    """
    found: list[Free] = []

    def visit(node: Any, path: Path) -> None:
        if isinstance(node, dict):
            for key, value in node.items():
                if key not in ("provenance", "wavelength_nm", "pass"):
                    visit(value, (*path, key))
        elif isinstance(node, list):
            for index, value in enumerate(node):
                visit(value, (*path, index))
        elif path[0] != "stopbands" or ".".join(map(str, path[1:])) in stopbands:
            kind = next(key for key in reversed(path) if isinstance(key, str))
            sigma, reach = _OWN_SPREAD.get(".".join(map(str, path)), _SPREAD[kind])
            mean = float(node)
            low = max(mean - reach, _FLOOR.get(kind, 1e-3))
            found.append(Free(path, mean, sigma, low, min(mean + reach, _CEILING.get(kind, np.inf))))

    visit(prior, ())
    return found


def with_values(
    prior: Mapping[str, Any], free: Sequence[Free], x: FloatArray, tied: Mapping[Path, Path]
) -> dict[str, Any]:
    """The parameter tree with the free parameters at `x`; each key of `tied` takes the value of its partner."""
    tree: dict[str, Any] = copy.deepcopy(dict(prior))
    for parameter, value in zip(free, x, strict=True):
        _put(tree, parameter.path, float(value))
    for path, partner in tied.items():
        _put(tree, path, _get(tree, partner))
    return tree


def checked(tree: Mapping[str, Any]) -> SurrogateParameters:
    """The tree as the parameters that the package builds curves from."""
    return SurrogateParameters.model_validate(tree)


def _get(tree: Any, path: Path) -> Any:
    for key in path:
        tree = tree[key]
    return tree


def _put(tree: Any, path: Path, value: float) -> None:
    _get(tree, path[:-1])[path[-1]] = value
