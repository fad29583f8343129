"""What is said of a validation: a sentence, tables, a page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...report.numbers import SHARE, digits
from ...report.page import Report, plain
from ...report.panels import GAIN, LOSS, Points, Section, axis_over
from ...report.tables import Axis, Column, Marks, Table
from .bench import ODD, UNKNOWNS
from .from_study import CAUSES
from .validation import Validation

_TINY = 1e-6
_MUCH, _LARGE = 2.0, 0.3
"""Chi-square a degree of freedom that a mended curve leaves, and change of a QE, that call for other reasons."""
_MOST_SIGMAS = 3.0
"""A residual beyond is marked."""
_RATIO = "over the brightest"


def sentence(validation: Validation) -> str:
    """Return the answer; `**` around what decides."""
    fit, mended = validation.fit, validation.mended
    mosaic, sigmas = fit.bench.setup.camera.mosaic, np.sqrt(fit.chi2 / fit.freedom)
    text = f"The study, with what was fitted, predicts {mosaic.name}'s readings within "
    text += f"**{100 * validation.within:.2g} %** ({sigmas:.2g} sigma): "
    if fit.p >= ODD:
        return f"{text}**no reason to doubt the model** (p = {fit.p:.2g})."
    text += f"**the readings do not fit the model** (p {f'= {fit.p:.2g}' if fit.p > _TINY else f'< {_TINY:g}'})."
    if mended is not None:
        how = f"{100 * abs(mended.change):.2g} % {'higher' if mended.change > 0 else 'lower'} than the study's"
        at = f"around {mended.middle_nm:.0f} nm"
        text += f" One curve mends most: **{mosaic.channels[mended.channel]}**, where it is {how} {at}."
        if mended.chi2_left > _MUCH * fit.freedom or abs(mended.change) > _LARGE:
            rest = f"chi-square {mended.chi2_left:.0f} of {fit.chi2:.0f} is left"
            text += f" But not all ({rest}): look at the spectra of lamps, exposures, and other curves."
    return text


def remarks(validation: Validation) -> list[str]:
    """Return the separation of the lamps, and how many readings count and why others do not."""
    bench, fit, said = validation.fit.bench, validation.fit, list[str]()
    if (apart := validation.separation) is not None:
        ends = [digits(apart.measured_dn + sign * apart.half_width_dn, 4) for sign in (-1, 1)]
        measured, predicted = " to ".join(ends), digits(apart.predicted_dn, 4)
        name, scene = "/".join(apart.types), bench.table["scene"].iloc[0]
        said.append(f"Separation {name} of these lamps in {scene}: measured {measured} DN, predicted {predicted} DN.")
    left_out = bench.left_out["left_out"].value_counts()
    others = "".join(f"; {size} left out {cause}" for cause, size in left_out.items())
    said.append(f"{len(bench.table)} readings{others}; chi-square {fit.chi2:.1f} at {fit.freedom} degrees of freedom.")
    return said


def unknowns(validation: Validation) -> Table:
    """Return what was fitted, beside what the study says."""
    rows, bench = {}, validation.fit.bench
    of_study = [*bench.first[:4], np.sqrt(bench.first[4])]
    for (name, (words, unit, _)), said in zip(UNKNOWNS.items(), of_study, strict=True):
        numbers = [*validation.fit.values[name], said]
        if np.isfinite(numbers).all():
            texts = [f"{digits(100 * number if unit == '%' else number, 4)} {unit}" for number in numbers]
            rows[words] = dict(zip(("value", "low", "high", "study"), texts, strict=True))
    columns = {"value": Column("fitted"), "low": Column("from", group="95 %"), "high": Column("to", group="95 %")}
    return Table({**columns, "study": Column("study")}, rows, head="unknown")


def lamps(validation: Validation) -> Table:
    """Return readings by lamp and place, and their ratios to the brightest place, which no scale of a lamp hides."""
    shown = validation.shown.reset_index()
    most = max(0.01, float(shown["residual"].abs().max()))
    shown["ratio"] = shown["signal_dn"] / shown["exposure_s"]
    top = shown.loc[shown.groupby("light")["ratio"].idxmax()].set_index("light")
    rows: dict[str, dict[str, Any]] = {}
    for row in shown.to_dict("records"):
        best, sigmas = top.loc[row["light"]], row["residual"] / row["sigma"]
        ratio, of_top = row["ratio"] / best["ratio"], row["place"] != best["place"]
        measured = ratio * (1 + row["residual"]) / (1 + best["residual"])
        color = LOSS if abs(sigmas) > _MOST_SIGMAS else GAIN
        rows[f"{Path(validation.fit.bench.lights[row['light']]).name} {row['channel']}"] = {
            "exposure": row["exposure_s"],
            "measured": row["dn"],
            "predicted": row["predicted_dn"],
            "residual": Marks(points=[(row["residual"], color)], text=f"{100 * row['residual']:+.2f} %"),
            "sigmas": f"{sigmas:+.1f}",
            "ratio": f"{measured:.4f}" if of_top else "",
            "of_study": f"{ratio:.4f}" if of_top else "",
        }
    columns = {
        "exposure": Column("exposure", "s"),
        "measured": Column("measured", "DN"),
        "predicted": Column("predicted", "DN"),
        "residual": Column("residual", axis=Axis("residual", SHARE, -most, most)),
        "sigmas": Column("sigma"),
        "ratio": Column("measured", group=_RATIO),
        "of_study": Column("predicted", group=_RATIO),
    }
    return Table(columns, rows, head="lamp and place")


def lines(validation: Validation) -> list[str]:
    """Return the answer for a terminal."""
    tables = [table.lines for table in (unknowns(validation), lamps(validation)) if table.rows]
    return [plain(sentence(validation)), *remarks(validation), *(line for table in tables for line in ("", *table))]


def report(validation: Validation, file: str) -> Report:
    """Return the page."""
    bench, note = validation.fit.bench, "The light of each lamp was fitted, too, where the table does not state it."
    lead = Section("Lamps and places", lamps(validation), (_panel(validation),), note=remarks(validation)[-1])
    held = [words for (words, *_), free in zip(UNKNOWNS.values(), bench.free, strict=False) if not free]
    conditions = [
        ("camera", f"{bench.setup.camera.mosaic.name} of {bench.study.name}"),
        ("readings", file),
        ("held as the study says", ", ".join(held) or "nothing"),
    ]
    method = [("method", "least squares over means, and over the noise where it was read; intervals of 95 %")]
    answer = " ".join([sentence(validation), *remarks(validation)[:-1]])
    sections = [Section("What was fitted", unknowns(validation), note=note)]
    return Report("validate", f"Readings against {bench.study.name}", answer, lead, sections, conditions, method, [])


def _panel(validation: Validation) -> Points:
    """Return predicted over measured signals of each channel."""
    lit = validation.rows[validation.rows["light"] >= 0]
    measured, predicted = lit["dn"] - validation.fit.unknowns[0], lit["signal_dn"]
    across, up = axis_over("measured signal", "DN", measured), axis_over("predicted signal", "DN", predicted)
    places = lit.groupby("channel").groups.items()
    groups = {str(place): (measured[at].to_numpy(), predicted[at].to_numpy()) for place, at in places}
    return Points("Predicted over measured", across, up, groups=groups)


def facts(validation: Validation) -> dict[str, Any]:
    """Return the answer as plain values."""
    fit, mosaic, mended = validation.fit, validation.fit.bench.setup.camera.mosaic, None
    if validation.mended is not None:
        mended = validation.mended._asdict() | {"channel": mosaic.channels[validation.mended.channel]}
        del mended["gained"]
    left_out = validation.fit.bench.left_out["left_out"]
    return {
        "cfa": mosaic.name,
        "within": validation.within,
        "chi2": fit.chi2,
        "degrees_of_freedom": fit.freedom,
        "p": fit.p,
        "unknowns": {name: dict(zip(("value", "low", "high"), fit.values[name], strict=True)) for name in UNKNOWNS},
        "mends_most": mended,
        "separation": None if validation.separation is None else validation.separation._asdict(),
        "left_out": {cause: int((left_out == cause).sum()) for cause in CAUSES},
    }
