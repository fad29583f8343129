"""A filter out of a finished run: as CSV for who makes it, as other programs' files for who simulates with it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..base.errors import Fault, OutputError
from ..base.types import FloatArray
from ..camera.mosaic import Mosaic
from ..curves.filter_files import color_hints, csv_text, filter_names, isetcam_mat, unique_names
from ..report import Output, check_kept, read_output, study_of
from ..results.atomic import write_bytes
from ..results.designs import find_row, row_curves
from ..study import Study, folder_name
from .export_also import other_files
from .options import Also

EXPORT = "export"
_SAME_TOTAL = 1e-9
_MOST_SHOWN = 10


@dataclass(frozen=True)
class Filters:
    """The channels of a CFA with a design's filters in it.

    `qe`: ndarray[n_channels, n_wavelengths], in the order of the mosaic's channels. `bases`: modified channel -> name
    of the curve that it replaces; `base_qe`: those curves, ndarray[n_wavelengths] each.
    """

    mosaic: Mosaic
    wavelength_nm: FloatArray
    qe: FloatArray
    bases: Mapping[str, str]
    base_qe: Mapping[str, FloatArray]

    @property
    def curves(self) -> dict[str, FloatArray]:
        """Channel -> QE."""
        return dict(zip(self.mosaic.channels, self.qe, strict=True))

    def transmissions(self) -> dict[str, FloatArray]:
        """`<channel>_over_<base>` -> transmission of each modified channel relative to the curve that it replaces.

        1 where neither has any light; infinite where the modified channel alone has some.
        """
        found = {}
        for channel, base in self.bases.items():
            made, base_qe = self.curves[channel], self.base_qe[channel]
            nothing = np.where(made > 0, np.inf, 1.0)
            with np.errstate(over="ignore"):
                found[f"{channel}_over_{base}"] = np.divide(made, base_qe, out=nothing, where=base_qe > 0)
        return found


def export_design(
    folder: Path,
    key: str,
    data: Path | None,
    to: Path | None,
    also: Collection[Also] = (),
    *,
    allow_code: bool = False,
) -> list[str]:
    """Write `<key>.csv` and `<key>.mat` of a design of a finished run to `to` (FOLDER/export), and say what it is.

    `key`: a name, a design_id, or `best`. The filter is computed again, from the study's files in `data`, or, without
    it, from the sensor's curves that the run kept, and compared with what the run kept of it. `also`: files of other
    programs beside them. Raises SweepError for an unknown key, for a design that failed, and for a sensor without what
    `also` needs; OutputError for a folder without a finished run, for curves that are not those of the run, and where
    a file of other content would be overwritten.
    """
    output = read_output(folder)
    row = find_row(output, key)
    study = study_of(output, data, allow_code=allow_code)
    filters = filters_of(study, row)
    _verify(output, row, filters)
    transmissions = filters.transmissions()
    finite = {name: values for name, values in transmissions.items() if np.isfinite(values).all()}
    hints = color_hints(filters.mosaic.channels, filters.bases)
    comment = _comment(output, row, filters)
    base = (folder / EXPORT if to is None else to) / folder_name(key)
    tables = filters.curves | finite
    tile = filters.mosaic.indices
    contents = {
        base.with_name(base.name + ".csv"): csv_text(filters.wavelength_nm, tables).encode("utf-8"),
        base.with_name(base.name + ".mat"): isetcam_mat(filters.wavelength_nm, filters.curves, hints, tile, comment),
    }
    others, said = other_files(also, base, filters.wavelength_nm, filters.curves, study, _design(output, row))
    for path, content in (contents | others).items():
        _refuse_other(path, content)
    for path, content in (contents | others).items():
        write_bytes(content, path)
    lines = [*_lines(output, row, filters), *_remarks(filters, transmissions)]
    csv_path, mat_path = contents
    names = ", ".join(filter_names(hints, filters.curves))
    lines.append(f"Files: {csv_path} ({', '.join(unique_names(tables))}),")
    lines.append(f"       {mat_path} ({names}: QE, so set the pixel's spectral QE to 1 in ISETCam).")
    return lines + said


def filters_of(study: Study, row: Mapping[Any, Any]) -> Filters:
    """The channels of a row's CFA, with its filters computed from its parameters."""
    space, made = row_curves(study, row)
    setup = study.setup(space, row["scenario"])
    qe = setup.camera.qe.copy()
    qe[list(setup.camera.modified)] = made[0]
    bases = {} if space.filter is None else space.filter.bases
    replaced = {channel: study.sensor.curve(base) for channel, base in bases.items()}
    return Filters(setup.camera.mosaic, study.grid.nodes_nm, qe, bases, replaced)


def _verify(output: Output, row: Mapping[Any, Any], filters: Filters) -> None:
    """Compare the filter with what the run kept of it, and with the row's sensitivity."""
    made = [filters.curves[channel] for channel in filters.bases]
    kept = output.curves.designs.get(int(row["design_id"]), {})
    check_kept(output, kept, {channel: filters.curves[channel] for channel in filters.bases})
    if made:
        ratio = sum(values.sum() for values in made) / sum(base.sum() for base in filters.base_qe.values())
        if not abs(ratio - row["sensitivity"]) <= _SAME_TOTAL * max(1.0, ratio):
            problem = "computed again, this is not what the run has: sensitivity"
            raise OutputError(Fault(problem, str(output.folder), allowed="the version of that run"))


def _refuse_other(path: Path, content: bytes) -> None:
    try:
        held = path.read_bytes() if path.is_file() else content
    except OSError as error:
        raise OutputError(Fault(f"cannot be read: {error.strerror or error}", str(path))) from None
    if held != content:
        raise OutputError(Fault("holds something else already", str(path), allowed="another --to, or delete it"))


def _parameters(output: Output, row: Mapping[Any, Any]) -> dict[str, float]:
    return {name: row[name] for name in output.parameters if row[name] is not None and row[name] == row[name]}


def _design(output: Output, row: Mapping[Any, Any]) -> str:
    name = f"{row['name']}, " if isinstance(row["name"], str) else ""
    return " ".join(f"{name}design {row['design_id']} of {output.study.study}".split())


def _comment(output: Output, row: Mapping[Any, Any], filters: Filters) -> str:
    own = ", ".join(f"{name}={value:.12g}" for name, value in _parameters(output, row).items())
    replaced = ", ".join(f"{channel} replaces {base}" for channel, base in filters.bases.items())
    origin = output.provenance.sensor
    kind = "surrogate: modeled, not measured" if origin.surrogate else f"from {origin.source}"
    parts = [
        f"{row['cfa']}: {_design(output, row)}",
        *([f"{row['family']}: {replaced}; {own}"] if own else []),
        "data is QE, electrons per photon, filters and silicon together: set the pixel's spectral QE to 1",
        f"sensor {origin.name}, {kind}",
        "filterOrder is the tile",
    ]
    return ". ".join(" ".join(part.split()) for part in parts) + "."


def _lines(output: Output, row: Mapping[Any, Any], filters: Filters) -> list[str]:
    own = _parameters(output, row)
    replaced = ", ".join(f"{channel} replaces {base}" for channel, base in filters.bases.items())
    lines = [f"{_design(output, row)}: {row['cfa']}" + (f", {row['family']}, {replaced}." if replaced else ", plain.")]
    if own:
        shown = ", ".join(f"{name} {value:.2f}" for name, value in list(own.items())[:_MOST_SHOWN])
        more = f" and {len(own) - _MOST_SHOWN} more" if len(own) > _MOST_SHOWN else ""
        lines.append(f"Parameters: {shown}{more}.")
    distances = ", ".join(
        f"{'/'.join(column.pair or ())} {column.amount(row[column.name])}"
        for column in (output.columns[name] for name in output.distances)
    )
    where = f" in {row['scenario']}" if len(output.scenarios) > 1 else ""
    modified = f"sensitivity {row['sensitivity']:.4f}, " if filters.bases else ""
    lines.append(f"CSDs{where}: {distances}; {modified}CFA sensitivity {row['cfa_sensitivity']:.4f}.")
    if not row["feasible"]:
        lines.append("Note: the design does not meet the study's constraints.")
    if output.provenance.sensor.surrogate:
        lines.append("Note: the curves are surrogates, modeled from stated parameters, not measured.")
    return lines


def _remarks(filters: Filters, transmissions: Mapping[str, FloatArray]) -> list[str]:
    """What whoever makes the filter must know of the transmissions."""
    lines = []
    for (channel, base), (name, values) in zip(filters.bases.items(), transmissions.items(), strict=True):
        beyond = filters.wavelength_nm[values > 1 + _SAME_TOTAL]
        if not np.isfinite(values).all():
            at = filters.wavelength_nm[~np.isfinite(values)][0]
            lines.append(f"Note: no {name} in the CSV: at {at:g} nm {channel} has light where {base} has none.")
        elif beyond.size:
            lines.append(
                f"Note: {name} is up to {values.max():.3g} (above 1 between {beyond[0]:g} and {beyond[-1]:g} nm): "
                f"the filter takes the place of that of {base}, it cannot be put before it."
            )
    return lines
