"""Whether a study predicts what its camera read on the bench."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from ...base.answer import Answer
from ...base.errors import DataError, SweepError, ValidationIssue, nearest
from ...results.atomic import atomic, write_text
from ...spectra.filter_files import csv_text
from ...study import Study, load_study
from ...study.shipped import study_path
from .bench import UNKNOWNS
from .from_study import bench_of
from .readings import DARK, read_readings
from .shown import facts, lines, report
from .validation import Validation

_PASSES = 3
"""Most times that readings are chosen anew by the range of the pixel that was fitted."""
_EXPOSURES_S = (0.003, 0.01)
"""Of a new table."""
PAGE, ROWS = "validation.html", "validation.parquet"


def validate(
    study: Path | str | Any,
    readings: Path | str | pd.DataFrame,
    *,
    cfa: str | None = None,
    hold: Sequence[str] = (),
    output: Path | str | None = None,
    corrected: Path | str | None = None,
    changes: Mapping[str, Any] | None = None,
    data: Path | str | None = None,
    allow_code: bool = False,
) -> Answer:
    """Compare readings of a camera before uniform lights with what a study predicts of them.

    The light of each lamp is fitted if the table does not say it, and so are black level, gain, shift of the IR cut,
    crosstalk and read noise, by least squares over the readings that are neither near full scale nor near 0.

    Parameters
    ----------
    study : path-like, or LoadedStudy
        The study of the camera.
    readings : path-like or pandas.DataFrame
        A row for each reading: ``lamp`` (a light of the study, the second level of `LoadedStudy.lights`, FILE:COLUMN
        or ``dark``), ``channel`` (or ``row`` and ``column`` in the tile, from 0), ``exposure_s``, ``dn`` (mean);
        optionally ``sigma_dn`` (temporal noise of a value), ``pixels`` and ``frames`` of the mean (1: the noise is
        over pixels; more: of each pixel over its frames), ``scene``, and ``irradiance (W/m2)`` or
        ``irradiance (photons/s/m2)`` on the sensor.
    cfa : str, optional
        CFA of the camera; left out, the first that has curves for the channels.
    hold : sequence of str
        Unknowns that stay as the study says: ``black``, ``gain``, ``shift``, ``crosstalk``, ``read_noise``.
    output : path-like, optional
        Folder of page and table; left out, outputs/validate-NAME.
    corrected : path-like, optional
        New file for the curves behind the shifted IR cut.
    changes : mapping of str to object
        Keys of the study, and values instead of the file's.
    data : path-like, optional
        Folder that the study's files are looked for in first.
    allow_code : bool
        Permit the code that the study names to run.

    Returns
    -------
    Answer
        How well the readings are predicted. ``facts`` has ``p`` (0 to 1: of residuals as large as these where the model
        is right), ``within`` (largest residual of a reading, relative to its signal), ``unknowns`` (of each name of
        ``hold`` its ``value`` and the ends ``low`` and ``high`` of its 95 % interval, NaN where it is held: DN, DN/e,
        nm, a share, e), ``mends_most`` (channel, wavelength and relative change of the one curve that mends most, and
        the chi-square that is left), ``separation`` (DN), ``chi2``, ``degrees_of_freedom`` and ``left_out``.

    Raises
    ------
    SweepError
        For faults of the table, each with its line, unknowns that the readings do not tell, and exchanged channels.

    Examples
    --------
    >>> import sweep
    >>> answer = sweep.validate("mine.yaml", "readings.csv", hold=["crosstalk"])  # doctest: +SKIP
    >>> answer.facts["unknowns"]["gain"]["value"]  # doctest: +SKIP
    0.4007
    """
    loaded = _loaded(study, data, changes, allow_code=allow_code)
    hold = [hold] if isinstance(hold, str) else [*(hold or ())]
    for name in hold:
        if name not in UNKNOWNS:
            known, near = ", ".join(UNKNOWNS), nearest(name, UNKNOWNS)
            raise SweepError(ValidationIssue("unknown name", None, None, "hold", name, known, near))
    file, table = read_readings(readings)
    bench = bench_of(loaded, file, table, cfa, hold)
    channels = bench.setup.camera.mosaic.channels
    if (pair := bench.exchanged()) is not None:
        problem = f"{channels[pair[0]]} and {channels[pair[1]]} look exchanged: so their readings fit"
        raise DataError(ValidationIssue(problem, file, 1, "channel", allowed="each reading with its channel"))
    fit = bench.fitted()
    for _ in range(_PASSES):
        black, gain = fit.unknowns[:2].tolist()
        bench = bench_of(loaded, file, table, cfa, hold, {"gain_dn_per_e": gain, "offset_dn": max(black, 0.0)})
        if len(bench.table) == len(fit.bench.table):
            break
        fit = bench.fitted()
    validation = Validation(fit)
    to = Path("outputs") / f"validate-{loaded.name}" if output is None else Path(output)
    with atomic(to / ROWS) as hidden:
        validation.rows.to_parquet(hidden, index=False)
    write_text(report(validation, file).html(), to / PAGE)
    said = [*lines(validation), f"Files: {to}/: {PAGE}, {ROWS}."]
    if corrected is not None:
        camera = validation.corrected.camera
        write_text(csv_text(loaded.grid.nodes_nm, dict(zip(channels, camera.qe, strict=True))), Path(corrected))
        numbers = camera.pixel.model_dump(include={"gain_dn_per_e", "offset_dn", "crosstalk"})
        pixel = ", ".join(f"{key}: {value:.6g}" for key, value in numbers.items())
        said.append(f"{corrected}: curves behind the shifted IR cut; with `pixel: {{{pixel}}}` the fitted camera.")
    return Answer(said, {"folder": str(to), **facts(validation)})


def bench_template(
    study: Path | str | Any,
    file: Path | str,
    *,
    changes: Mapping[str, Any] | None = None,
    data: Path | str | None = None,
    allow_code: bool = False,
) -> Answer:
    """Write a table of readings with the lamps and channels of a study, for numbers to be filled in.

    Parameters
    ----------
    study, changes, data, allow_code
        As for `validate`.
    file : path-like
        New table.

    Returns
    -------
    Answer
        What was written.

    Raises
    ------
    SweepError
        If the file exists, or cannot be written.
    """
    loaded, path = _loaded(study, data, changes, allow_code=allow_code), Path(file)
    if path.exists():
        raise SweepError(ValidationIssue("is there already, and stays as it is", str(path), allowed="another name"))
    channels = next(iter(loaded.mosaics.values())).channels
    rows = [(DARK, channel, exposure_s) for exposure_s in _EXPOSURES_S for channel in channels]
    rows += [(lamp, name, time_s) for lamp in loaded.lights.names for time_s in _EXPOSURES_S for name in channels]
    table = pd.DataFrame(rows, columns=["lamp", "channel", "exposure_s"])
    write_text(table.assign(dn="", sigma_dn="", pixels="").to_csv(index=False), path)
    return Answer(
        [f"{path}: {len(rows)} readings to fill in; leave out lamps that you do not have."], {"file": str(path)}
    )


def _loaded(
    study: Path | str | Any, data: Path | str | None, changes: Mapping[str, Any] | None, *, allow_code: bool
) -> Study:
    if isinstance(study, str | Path):
        folder = None if data is None else Path(data)
        return load_study(study_path(Path(study)), folder, changes=changes or {}, allow_code=allow_code)
    loaded = getattr(study, "study", study)
    if not isinstance(loaded, Study):
        raise SweepError(
            ValidationIssue("no study", value=type(study).__name__, allowed="a file, a name, a loaded study")
        )
    return loaded
