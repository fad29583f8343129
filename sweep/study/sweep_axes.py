"""A sweep as values of each parameter, and how designs are made of them."""

from __future__ import annotations

from ..designs.ungridded import Drawn, Method, Paired, Ungridded
from .schema import SweepSection


def sweep_axes(sweep: SweepSection, seed: int) -> tuple[str, dict[str, tuple[float, ...]], Ungridded | None]:
    """The key that its parameters stand under, their values, and its designs where they are no grid."""
    if sweep.grid is not None:
        return "grid", {name: axis.points() for name, axis in sweep.grid.items()}, None
    if sweep.box is not None:
        method: Method = "sobol" if sweep.sobol is not None else "lhs"
        drawn = Drawn(method, sweep.sobol or sweep.lhs or 0, seed)
        return "box", {name: axis.points() for name, axis in sweep.box.items()}, drawn
    if sweep.paired is not None:
        columns = {name: axis.points() for name, axis in sweep.paired.items()}
        return "zip", columns, Paired(max(map(len, columns.values())))
    designs = sweep.listed or []
    return "list", {name: tuple(design[name] for design in designs) for name in designs[0]}, Paired(len(designs))
