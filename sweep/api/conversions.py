"""Runs in the forms of other libraries."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np
from colour import MultiSpectralDistributions

from ..base.errors import SweepError, ValidationIssue
from ..results.designs import channel_curves, find_design_row
from ..results.output import Output
from ..study import Study

if TYPE_CHECKING:
    import pandas as pd
    import xarray

_OF_A_DESIGN = ("kind", "space", "name", "cfa", "family")


def to_xarray(table: pd.DataFrame, output: Output) -> xarray.Dataset:
    """Return the quantities of all designs over design and scenario."""
    if find_spec("xarray") is None:
        allowed = "pip install cfa-sweep[xarray]"
        raise SweepError(ValidationIssue("the package xarray is not installed", allowed=allowed))
    table = table.rename(columns={"filter_id": "design"}).astype({"scenario": "str"}).set_index(["design", "scenario"])
    of_design = [name for name in (*_OF_A_DESIGN, *output.parameters) if name in table]
    labels = table[of_design].groupby(level="design", sort=False).first()
    values = table.drop(columns=[*of_design, "design_id"]).to_xarray()
    values = values.assign_coords({name: ("design", labels[name].to_numpy()) for name in of_design})
    for name, column in output.columns.items():
        if name in values:
            values[name].attrs = {"units": column.unit, "long_name": column.meaning}
    return values


def to_multispectral(output: Output, study: Study, design: str | int) -> MultiSpectralDistributions:
    """Return the QE of a design's channels."""
    curves = channel_curves(study, find_design_row(output, design))
    table, name = np.stack([*curves.values()], axis=1), f"{output.study.study}, {design}"
    return MultiSpectralDistributions(table, study.grid.nodes_nm, labels=[*curves], name=name)
