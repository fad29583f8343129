"""A filter of a finished run: as CSV for who makes it, as other programs' files for who simulates with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...base.answer import Answer
from ...base.errors import OutputError, SweepError, ValidationIssue
from ...base.types import PerWavelength
from ...results.atomic import write_bytes
from ...results.designs import BEST, channel_curves, find_design_row, row_space, study_of
from ...results.folder import run_folder
from ...results.output import Output, read_output
from ...spectra.filter_files import (
    color_hints,
    csv_text,
    filter_names,
    isetcam_mat,
    unique_names,
)
from ...study import Study, folder_name
from ..map.bands import specification as specification_of

_ROUNDING = 1e-9
_MOST_SHOWN = 10
Row = Mapping[Any, Any]


def export(
    folder: Path | str,
    design: str | int | Sequence[str | int] = BEST,
    data: Path | str | None = None,
    *,
    output: Path | str | None = None,
    specification: bool = False,
    allow_code: bool = False,
    force: bool = False,
) -> Answer:
    """Write a filter of a finished run as CSV and as ISETCam color filters (.mat), and say what it is.

    The filter is computed again and compared with what the run kept of it.

    Parameters
    ----------
    folder : path-like
        Folder of a finished run.
    design : str or int, or several
        A `filter_id`, a name (paper_N4, RGGB), or best.
    data : path-like, optional
        Folder of the study's files; left out, the curves that the run kept are taken.
    output : path-like, optional
        Folder of the new files; left out, FOLDER/export.
    specification : bool
        Also write what an absorption band of the study's map would have to be.
    allow_code : bool
        Permit the code that the study names to run.
    force : bool
        Replace files of other content.

    Returns
    -------
    Answer
        Parameters, separations and files of the design.

    Raises
    ------
    SweepError
        For an unknown design or one that failed, a folder without a finished run, curves that are not those of the
        run, a specification without a map, and where a file of other content would be overwritten.
    """
    folder = run_folder(folder)
    run, to = read_output(folder), folder / "export" if output is None else Path(output)
    study = study_of(run, None if data is None else Path(data), allow_code=allow_code)
    contents, lines, facts = dict[Path, bytes](), list[str](), list[dict[str, Any]]()
    for key in [design] if isinstance(design, str | int) else design:
        row = find_design_row(run, key)
        files, text = _design_files(run, study, row, to / folder_name(str(key)), specification=specification)
        contents |= files
        lines += text
        labels = {name: row[name] for name in ("design_id", "filter_id", "name", "cfa", "family", "scenario")}
        facts.append(labels | {"parameters": _parameters(run, row), "files": [str(file) for file in files]})
    for file, content in () if force else contents.items():
        _refuse_other(file, content)
    for file, content in contents.items():
        write_bytes(content, file)
    return Answer(lines, {"folder": str(folder), "designs": facts})


def _design_files(
    run: Output, study: Study, row: Row, path: Path, *, specification: bool
) -> tuple[dict[Path, bytes], list[str]]:
    """Return the files of a design, under the stem of `path`, and what to say of them."""
    space, mosaic = row_space(study, row), study.mosaics[row["cfa"]]
    wavelength_nm, curves = study.grid.nodes_nm, channel_curves(study, row)
    bases = {} if space.filter is None else dict(space.filter.bases)
    base_qe = {channel: study.sensor.curve(name) for channel, name in bases.items()}
    _verify(run, row, {channel: curves[channel] for channel in bases}, base_qe)

    transmissions = {
        f"{channel}_over_{name}": relative_transmission(curves[channel], base_qe[channel])
        for channel, name in bases.items()
    }
    table = curves | {name: values for name, values in transmissions.items() if np.isfinite(values).all()}
    hints = color_hints(mosaic.channels, bases)
    csv_path, mat_path = (path.with_name(path.name + suffix) for suffix in (".csv", ".mat"))
    comment = _comment(run, row, bases)
    files = {
        csv_path: csv_text(wavelength_nm, table).encode("utf-8"),
        mat_path: isetcam_mat(wavelength_nm, curves, hints, mosaic.indices, comment),
    }
    lines = [
        *_lines(run, row, bases),
        *_remarks(wavelength_nm, bases, transmissions),
        f"Files: {csv_path} ({', '.join(unique_names(table))}),",
        f"       {mat_path} ({', '.join(filter_names(hints, curves))}: QE, so set the pixel's spectral QE to 1 in "
        "ISETCam).",
    ]
    if specification:
        specified, specified_table = path.with_name(f"{path.name}_specification.csv"), specification_of(run)
        if specified_table is None:
            problem, allowed = (
                "no map of absorption bands",
                "a study with `search: {map: {peak_nm: ..., fwhm_nm: ...}}`",
            )
            raise SweepError(ValidationIssue(problem, str(run.folder), None, "--specification", None, allowed))
        files[specified] = specified_table.to_csv(index=False).encode("utf-8")
        lines.append(f"       {specified} (what an absorption band would have to be)")
    return files, lines


def relative_transmission(modified: PerWavelength, base: PerWavelength) -> PerWavelength:
    """Return the transmission of a modified channel relative to the curve that it replaces.

    1 where both are zero, infinite where only `base` is.
    """
    unlit = np.where(modified > 0, np.inf, 1.0)
    with np.errstate(over="ignore"):
        return np.divide(modified, base, out=unlit, where=base > 0)


def _verify(
    output: Output, row: Row, modified: Mapping[str, PerWavelength], base_qe: Mapping[str, PerWavelength]
) -> None:
    """Compare the modified channels with the row's sensitivity."""
    if modified:
        kept, whole = (output.study.wavelengths.integrate(np.array([*qe.values()])).sum() for qe in (modified, base_qe))
        ratio = float(kept / whole)
        if not abs(ratio - row["sensitivity"]) <= _ROUNDING * max(1.0, ratio):
            problem = "computed again, the sensitivity differs from the run"
            raise OutputError(ValidationIssue(problem, str(output.folder), allowed="the version of that run"))


def _refuse_other(path: Path, content: bytes) -> None:
    try:
        held = path.read_bytes() if path.is_file() else content
    except OSError as error:
        raise OutputError(ValidationIssue(f"cannot be read: {error.strerror or error}", str(path))) from None
    if held != content:
        raise OutputError(
            ValidationIssue("holds something else already", str(path), allowed="another --output, or --force")
        )


def _parameters(output: Output, row: Row) -> dict[str, float]:
    return {name: row[name] for name in output.parameters if row[name] is not None and row[name] == row[name]}


def _design(output: Output, row: Row) -> str:
    name = f"{row['name']}, " if isinstance(row["name"], str) else ""
    return " ".join(f"{name}design {row['design_id']} of {output.study.study}".split())


def _comment(output: Output, row: Row, bases: Mapping[str, str]) -> str:
    """Comment of the `.mat` file."""
    parameters = ", ".join(f"{name}={value:.12g}" for name, value in _parameters(output, row).items())
    replaced = ", ".join(f"{channel} replaces {base}" for channel, base in bases.items())
    origin = output.provenance.sensor
    kind = "surrogate: modeled, not measured" if origin.surrogate else f"from {origin.source}"
    parts = [
        f"{row['cfa']}: {_design(output, row)}",
        *([f"{row['family']}: {replaced}; {parameters}"] if parameters else []),
        "data is QE, electrons per photon, filters and silicon together: set the pixel's spectral QE to 1",
        f"sensor {origin.name}, {kind}",
        "filterOrder is the tile",
    ]
    return ". ".join(" ".join(part.split()) for part in parts) + "."


def _lines(output: Output, row: Row, bases: Mapping[str, str]) -> list[str]:
    parameters = list(_parameters(output, row).items())
    replaced = ", ".join(f"{channel} replaces {base}" for channel, base in bases.items())
    lines = [f"{_design(output, row)}: {row['cfa']}" + (f", {row['family']}, {replaced}." if replaced else ", plain.")]
    if parameters:
        shown = ", ".join(f"{name} {value:.2f}" for name, value in parameters[:_MOST_SHOWN])
        more = f" and {len(parameters) - _MOST_SHOWN} more" if len(parameters) > _MOST_SHOWN else ""
        lines.append(f"Parameters: {shown}{more}.")
    columns = [output.columns[name] for name in output.distances]
    distances = ", ".join(f"{'/'.join(c.pair or ())} {c.amount(row[c.name])}" for c in columns)
    where = f" in {row['scenario']}" if len(output.scenarios) > 1 else ""
    sensitivity = f"sensitivity {row['sensitivity']:.4f}, " if bases else ""
    lines.append(f"CSDs{where}: {distances}; {sensitivity}CFA sensitivity {row['cfa_sensitivity']:.4f}.")
    if not row["feasible"]:
        lines.append("Note: the design does not meet the study's constraints.")
    if output.provenance.sensor.surrogate:
        lines.append("Note: the curves are surrogates, modeled from stated parameters, not measured.")
    return lines


def _remarks(
    wavelength_nm: PerWavelength, bases: Mapping[str, str], transmissions: Mapping[str, PerWavelength]
) -> list[str]:
    """Describe the transmissions for the manufacturer of the filter."""
    lines = []
    for (channel, base), (name, values) in zip(bases.items(), transmissions.items(), strict=True):
        beyond = wavelength_nm[values > 1 + _ROUNDING]
        if not np.isfinite(values).all():
            at = wavelength_nm[~np.isfinite(values)][0]
            lines.append(f"Note: no {name} in the CSV: at {at:g} nm {channel} has light where {base} has none.")
        elif beyond.size:
            lines.append(
                f"Note: {name} is up to {values.max():.3g} (above 1 between {beyond[0]:g} and {beyond[-1]:g} nm): "
                f"the filter takes the place of that of {base}, it cannot be put before it."
            )
    return lines
