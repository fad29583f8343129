"""Data dictionary: content of the files of a run and meaning of the columns, as printed in the documentation."""

from __future__ import annotations

import json
from collections.abc import Mapping

import pyarrow as pa

from ..features import gathered
from ..metrics.columns.sensitivity import CFA_SENSITIVITY, reference_of
from ..metrics.quantity import DN, UPPER_BOUND, Column, RequestedQuantities
from ..metrics.registry import every_feature, listed
from ..study.inputs import INPUTS
from . import tables as files
from .curves import SCHEMA
from .shown import MOST_POINTS

_KEYS = {
    ("design_id",): "number of the row: a filter in a scenario",
    ("filter_id",): "number of the filter, the same in every scenario and table of the study",
    (
        "kind",
    ): "a plain CFA (`reference`), a named design (`design`), a swept one (`sweep`), the search's answer (`search`)",
    ("name",): "name of a plain CFA, a named design or the search's answer",
    ("space",): "name of the sweep, box, design or CFA of the study that the filter belongs to",
    ("cfa", "family", "scenario"): "CFA, filter family and scenario",
    ("series", "key", "value"): "where scenarios are made by `each`: the scenario that has it, the dotted key by whose "
    "value each one differs (null in a grid), and that value",
    ("pixel.bits, ...",): "value of each key of `each`, by its dotted name",
    ("left_nm, ...",): "parameters of the families, unit in the name",
}
_VERDICTS = {
    ("feasible",): "whether all constraints are met; a design with an unknown constrained quantity is not feasible",
    (
        "violation",
    ): "largest violation of a constraint, relative to its bound; null where a constrained quantity is unknown",
    ("objective",): "the study's objective, where it is of several quantities",
    (
        UPPER_BOUND,
        "gap",
    ): "of the search's answer, in the unit of the objective: what no filter exceeds (between the least transmission "
    "and the replaced curve, same constraints, before clipping and quantization; a design may read a little more after "
    "rounding), and how far below it the answer is",
    ("pareto",): "not in `results.parquet`, but in `pareto.parquet` and `designs.parquet`: not dominated in separation "
    "and sensitivity among the designs of its CFA and scenario that meet every constraint but those on these two",
    (
        "simulation_key",
        "omitted_effects_bound_dn",
    ): "which effects and settings the scene was simulated with (`provenance.json` says them in full), and a bound on "
    "what the effects that were left out change in any CSD, also at the best sampling phase and with shifted edges",
    ("status",): "`ok`, or the failure",
}
_WORST = (
    "the worst case of a CSD or sensitivity over edges that production shifts and films that it makes too thick or "
    "too thin (five errors from one end of both to the other, and the two other corners), "
    "and of a CSD over the population of the lights: then that of the response before clipping and rounding, with "
    "all effects, over all members exactly"
)
_OF_A_SHARE = (
    "the CSD that at least the share `population.wanted_yield` of the drawn lamps and cameras has, or "
    "`uncertainty.wanted_yield` of cameras with random curves that see all lights (with a population, two random lamps "
    "each), and with 95 % "
    "confidence (one-sided, binomial) that share of all, where the design was not chosen by the same draws, as a "
    "search's is: the mean of the draws that rank right below, a tenth of all that may have less, before clipping and "
    "rounding, with all effects; no upper bound is computed of it, and one of others leaves a constraint on it out"
)
_OWN = (
    "a metric of the study's `metrics`, the worst over moments and phases; its error is not checked: the tolerance in "
    "DN is of CSDs"
)
_WITHOUT_CLEAR = f"; without a clear pixel 1 = {reference_of('<name>')}"
KEYS = tuple(name for names in (*_KEYS, *_VERDICTS) for name in names)
"""Columns that are no quantities of a metric."""


def described(schema: pa.Schema, columns: Mapping[str, Column]) -> pa.Schema:
    """Return a schema whose fields carry `unit` and `meaning`, which pandas reads as `DataFrame.attrs`."""
    meanings = {name: text for names, text in (_KEYS | _VERDICTS).items() for name in names}
    meanings |= {name: column.meaning for name, column in columns.items() if column.meaning}
    units = {name: column.unit for name, column in columns.items()}
    attrs = {
        kind: {name: words[name] for name in schema.names if name in words}
        for kind, words in (("units", units), ("meanings", meanings))
    }
    fields = [
        field.with_metadata({"unit": units.get(field.name, ""), "meaning": meanings[field.name]})
        if field.name in meanings
        else field
        for field in schema
    ]
    return pa.schema(fields, {**(schema.metadata or {}), b"PANDAS_ATTRS": json.dumps(attrs).encode()})


def columns_table() -> list[str]:
    """Return a Markdown table of columns, units and meanings; `<a>`, `<b>` stand for any two signal types."""
    types = ("<a>", "<b>")
    rows = [_row(names, "", meaning) for names, meaning in _KEYS.items()]
    requested = RequestedQuantities(types, types, any_place=True, features=every_feature())
    for quantity in listed(requested):
        more = _WITHOUT_CLEAR if quantity.name == CFA_SENSITIVITY else ""
        rows.append(_row((quantity.name,), quantity.unit, quantity.meaning + more))
    rows.append(_row(("<own metric>",), "its own", _OWN))
    rows.append(_row(("worst_<quantity>",), "", _WORST))
    rows.append(_row(("yield_csd_<a>_<b>",), DN, _OF_A_SHARE))
    rows += [_row(names, "", meaning) for names, meaning in _VERDICTS.items()]
    return ["| column | unit | meaning |", "| --- | --- | --- |", *rows]


FILES = {
    f"{files.RESULTS}/": "a row per design and scenario, a dataset of parts, with the columns that a study asks "
    "for, or all that are below (`columns: all`, or a study without sweeps; of scenarios that one number tells apart, "
    "distances that the study does not name are of the first alone)",
    files.PARETO: "the Pareto front of each CFA and scenario, with all columns",
    files.DESIGNS: "designs that the report shows: plain CFAs, named designs, answers of the search, the best of each "
    "sweep, those that lead, and a sample of the front, with all columns; and up to "
    f"{MOST_POINTS:,} other feasible and as many infeasible ones, evenly, with those of the dataset",
    files.LIMITED_BY: "the two lights that limit each CSD, of plain CFAs, named designs, answers of the search, and "
    "of the swept designs that the report draws: `design_id`, `limited_by_<a>_<b>` (for any sampling phase, at the "
    "worst one of the lattice that was computed)",
    files.SEARCH_LOG: "every evaluation of the search and of its front: "
    + ", ".join(files.search_schema(["<parameters>"]).names),
    files.COMBINATIONS: "where a search chooses from colorants, every combination that was tried, the best first: how "
    "many `colorants`, their numbers and names, the absorbance of each at its peak in 0.8 um (`absorbance_1`), for "
    "catalogs of molar extinction its concentration (`mol_per_l_1`), `thickness_um`, objective and sensitivity before "
    "clipping and quantization, `violation` and `feasible`",
    files.FRONT: "results of the search at each level of sensitivity, and the upper bound there; between two levels "
    "rows with the bound alone: " + ", ".join(files.front_schema(["<parameters>"]).names),
    files.CURVES: "a row per curve and wavelength: " + ", ".join(SCHEMA.names),
    files.POINTS: "points of the clouds: design_id, signal_type, signal, channel, dn",
    files.CROSSINGS: "where scenarios differ in one number: the numbers `at` which a range of a plain CFA, named "
    "design or answer of the search ends, with all effects. With `recognition`, where an error is the allowed one "
    "(`quantity`: `state_error` of lamps of equal brightness, or `chromatic_error` of lamps of any), and the `error` "
    "there; and where the separation is that of another design (`against`), and its `value`. `rises`: it is larger "
    "beyond",
    files.SATURATED: "for each plain CFA, named design and answer of the search (`design_id`), how many of the "
    "`signals` fill a pixel of any channel (`full_signals`), of an HDR pixel all its captures",
    files.WORST: "where scenarios differ in one number, and lamps are pulsed or the search maximizes the worst of the "
    "scenarios: for each plain CFA, named design and answer of the search the worst `value` of a `quantity`, and the "
    "number `at` which it is, also between two scenarios, with all effects",
    files.HANDOVERS: "where the pixel has captures and scenarios differ in one number: for each plain CFA, named "
    "design and answer of the search (`name`), channel and signal type, the number `at` which the median signal "
    "reaches the threshold of each capture (from 1 on), or saturation of the last one; inf: at none of the series, "
    "-inf: at all",
    files.RESOLVED: "the study with every default written out; a study file itself",
    INPUTS: "the files of curves that the study was made from, with which `study.resolved.yaml` runs anywhere",
    files.PROVENANCE: "versions, seed, command, machine, plans of the scenes, meanings of the columns",
    files.REPORT: "the report: one file that you can send, without the network",
    "pareto.png": "the filter over the lamps, and separation against the light of all CFAs; also `.svg`",
    files.MANIFEST: "owner of the folder, the fingerprint of the study and its inputs, and the SHA-256 of each file",
}
"""Files of the core in a run's folder, in the order in which one asks for them."""


def files_table() -> list[str]:
    """Return a Markdown table of files and contents."""
    every = FILES | gathered("FILES") | gathered("ADDED") | gathered("DRAWN")
    return ["| file | contents |", "| --- | --- |", *(f"| `{name}` | {what} |" for name, what in every.items() if what)]


def _row(names: tuple[str, ...], unit: str, meaning: str) -> str:
    return f"| {', '.join(f'`{name}`' for name in names)} | {unit} | {meaning} |"
