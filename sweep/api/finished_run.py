"""A finished run as a Python object."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.errors import OutputError, SweepError, ValidationIssue, nearest
from ..metrics.quantity import Column
from .inline_curves import wavelength_table
from .loaded_study import LoadedStudy
from .user_filters import with_units

if TYPE_CHECKING:
    import pandas as pd
    import xarray
    from colour import MultiSpectralDistributions

    from ..report import Output
    from ..vision.batches import Batch, Form


_OF_A_DESIGN = ("kind", "space", "name", "cfa", "family")


class FinishedRun:
    """Results of a finished run.

    Parameters
    ----------
    folder : Path
        Output folder of the study.
    data : Path, optional
        Folder of the study's files.
    allow_code : bool
        Permit the code that the run was made with to run.

    Raises
    ------
    SweepError
        If files are missing or differ from those that the run wrote.

    Examples
    --------
    >>> import sweep
    >>> run = sweep.read_run("outputs/stopband")  # doctest: +SKIP
    >>> run.best.csd_yellow_red  # doctest: +SKIP
    233.8
    """

    def __init__(self, folder: Path, data: Path | None = None, *, allow_code: bool = False) -> None:
        from ..report import read_output

        self.folder, self._data, self._allow_code = folder, data, allow_code
        self.output: Output = read_output(self.folder)

    def __repr__(self) -> str:
        return f"<run {self.output.study.study}: {self.output.provenance.filters:,} filters in {self.folder}>"

    @cached_property
    def table(self) -> pd.DataFrame:
        """Result table with one row per design and scenario; units and meanings are in ``attrs``."""
        import pyarrow as pa

        from ..results.manifest import Manifest

        columns: Mapping[str, Column] = self.output.columns
        return with_units(pa.concat_tables(Manifest(self.folder).batches()).unify_dictionaries().to_pandas(), columns)

    def to_xarray(self) -> xarray.Dataset:
        """Return the quantities of all designs over design and scenario, with units and meanings.

        Returns
        -------
        xarray.Dataset
            A variable per quantity over ``design`` (its `filter_id`) and ``scenario``; parameters, names, families and
            CFAs are coordinates along ``design``. Needs the package xarray (``pip install cfa-sweep[xarray]``).
        """
        if find_spec("xarray") is None:
            allowed = "pip install cfa-sweep[xarray]"
            raise SweepError(ValidationIssue("the package xarray is not installed", allowed=allowed))
        table = self.table.rename(columns={"filter_id": "design"}).astype({"scenario": "str"})
        table = table.set_index(["design", "scenario"])
        of_design = [name for name in (*_OF_A_DESIGN, *self.output.parameters) if name in table]
        labels = table[of_design].groupby(level="design", sort=False).first()
        values = table.drop(columns=[*of_design, "design_id"]).to_xarray()
        values = values.assign_coords({name: ("design", labels[name].to_numpy()) for name in of_design})
        for name, column in self.output.columns.items():
            if name in values:
                values[name].attrs = {"units": column.unit, "long_name": column.meaning}
        return values

    def to_multispectral(self, design: str = "best") -> MultiSpectralDistributions:
        """Return the QE of a design's channels as colour-science has it.

        Parameters
        ----------
        design : str
            A `filter_id`, a name (RYN4Cy, RGGB), or best.

        Returns
        -------
        colour.MultiSpectralDistributions
            A column per channel over nm.

        Raises
        ------
        SweepError
            If there is no such design.
        """
        from colour import MultiSpectralDistributions

        from ..results.designs import channel_curves, find_design_row

        curves = channel_curves(self.study.study, find_design_row(self.output, design))
        name = f"{self.output.study.study}, {design}"
        return MultiSpectralDistributions(
            np.stack([*curves.values()], axis=1), self.study.wavelength_nm, labels=[*curves], name=name
        )

    @property
    def best(self) -> pd.Series:
        """Best feasible design that was swept or searched; raises SweepError if there is none."""
        if self.output.best.empty:
            raise OutputError(
                ValidationIssue("the run has no feasible design that was swept or searched", str(self.folder))
            )
        return self.output.best.iloc[0].dropna()

    @property
    def curves(self) -> pd.DataFrame:
        """QE curves of the run over nm; columns are ("sensor", curve) and (design_id, channel)."""
        stored = self.output.curves
        columns: dict[tuple[Any, str], np.ndarray] = {("sensor", name): curve for name, curve in stored.sensor.items()}
        columns |= {(i, channel): curve for i, filters in stored.designs.items() for channel, curve in filters.items()}
        table = wavelength_table(stored.wavelength_nm, columns)
        table.columns.names = ["design", "curve"]
        return table

    @cached_property
    def study(self) -> LoadedStudy:
        """Study that was run, with the curves that the run kept."""
        from ..report import study_of

        return LoadedStudy(study_of(self.output, self._data, allow_code=self._allow_code))

    @property
    def summary(self) -> str:
        """Summary of the run as `sweep run` prints it."""
        from ..report import summary_lines

        return "\n".join(summary_lines(self.output))

    def images(self, split: str = "test", designs: Sequence[str] | None = None, form: Form = "raw") -> Iterator[Batch]:
        """Yield labeled images of the run's benchmark of vision, up to 1,024 at once, without files.

        Parameters
        ----------
        split : {'train', 'check', 'test'}
            Split. The readers of the run have read those of the test.
        designs : sequence of str, optional
            Names of designs, such as "RGGB"; all of them by default.
        form : {'raw', 'demosaicked', 'isp'}
            Raw mosaics (uint16 DN, float32 of HDR pixels), every channel at every pixel (float32 DN above the black
            level), or pictures of a plain ISP (uint8 sRGB).

        Yields
        ------
        Batch
            `images`, ndarray of shape (n, rows, columns) or (n, rows, columns, n_channels), and `labels`, a table with
            the columns of an exported manifest.

        Raises
        ------
        SweepError
            If the run has no images, or no such design, split or form.
        """
        from ..run.image_files import images_of_run
        from ..vision.batches import FORMS
        from ..vision.lamps import SPLITS

        names = list(self._images_of_test()["name"].unique())
        chosen = names if designs is None else list(designs)
        for value, known in ((split, SPLITS), (form, FORMS), *((name, names) for name in chosen)):
            if value not in known:
                allowed, near = ", ".join(known), nearest(value, known)
                raise SweepError(ValidationIssue("unknown", value=value, allowed=allowed, nearest=near))
        return images_of_run(self.study.study, self.output.named_rows, split, chosen, form)

    def score(self, predictions: pd.DataFrame) -> pd.DataFrame:
        """Score a reader's answers to the test images of the run's benchmark of vision.

        Parameters
        ----------
        predictions : pandas.DataFrame
            Columns `image_id`, and `state` (or "unknown") or a probability of each state.

        Returns
        -------
        pandas.DataFrame
            Errors of each design, by order of the lenses, distance and light level, with intervals; differences from
            the first design and from the ideal observer, paired; calibration.

        Raises
        ------
        SweepError
            If the run has no images, and for other, double or missing images or answers.
        """
        from ..run.score import reader_of, scores_of
        from ..vision.scenes import states_of

        images, vision = self._images_of_test(), self.output.study.vision
        assert vision is not None
        table = predictions.reset_index(drop=True)
        return scores_of(reader_of(table, Path("predictions"), images, states_of(vision)), images, vision.unknown_cost)

    def _images_of_test(self) -> pd.DataFrame:
        from ..results.tables import VISION
        from ..run.score import images_of_test

        if self.output.study.vision is None:
            raise SweepError(ValidationIssue("the study has no `vision`", str(self.folder)))
        return images_of_test(self.output.vision[VISION])

    def report(self) -> Path:
        """Draw figures and report again.

        Returns
        -------
        Path
            The report, ``report.html``.
        """
        from ..report import make_report
        from ..results.tables import REPORT

        make_report(self.output)
        return self.folder / REPORT
