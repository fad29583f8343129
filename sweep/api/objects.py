"""A study and a finished run as Python objects."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ..base.errors import OutputError, SweepError, ValidationIssue, nearest
from ..camera.plan import Plan
from ..designs.space import Space
from ..metrics.quantity import Column, Quantity
from ..search.upper_bound import UpperBound
from ..study import Study
from .inline_curves import CurveLike, filter_on_grid, wavelength_table
from .own_designs import are_parameters, designs_of_curves, designs_of_parameters, evaluate_spaces, plain_and_named
from .user_filters import (
    any_filter_search,
    find_cfa,
    known_cfa,
    known_scenario,
    replaced_curves,
    upper_bound_or_reason,
    with_lower_bound,
    with_units,
)

if TYPE_CHECKING:
    import pandas as pd

    from ..report import Output


class LoadedStudy:
    """A checked study, which evaluates filters, bounds them, and runs.

    Parameters
    ----------
    study : Study
        The study as the other subpackages use it: ``pixel``, ``scenarios``, ``constraints``, ``mosaics``, ``spaces``.

    Examples
    --------
    >>> import sweep
    >>> study = sweep.load_study("stopband")
    >>> table = study.evaluate(N=0.9 * study.curve("Y"))
    >>> f"{table.csd_yellow_red[0]:.0f} DN at a sensitivity of {table.sensitivity[0]:.2f}"
    '35 DN at a sensitivity of 0.90'
    """

    def __init__(self, study: Study) -> None:
        self.study = study

    def __repr__(self) -> str:
        return f"<study {self.name}: {self.study.n_designs:,} designs on {', '.join(self.cfas)}>"

    def _repr_html_(self) -> str:
        return f"<pre>{escape(repr(self))}\n{escape(self.study.section.question)}</pre>"

    @property
    def name(self) -> str:
        """Name of the study."""
        return self.study.name

    @property
    def cfas(self) -> tuple[str, ...]:
        """Names of the CFAs."""
        return tuple(self.study.mosaics)

    @property
    def wavelength_nm(self) -> np.ndarray:
        """Wavelengths of all curves, nm."""
        return self.study.grid.nodes_nm

    @property
    def quantities(self) -> Mapping[str, Quantity]:
        """Quantities of every design by column name, with unit, meaning and allowed constraints."""
        return self.study.quantities

    @property
    def curves(self) -> pd.DataFrame:
        """QE of the sensor, one column per curve; the index is nm."""
        return wavelength_table(self.wavelength_nm, self.study.sensor.qe)

    def curve(self, name: str) -> pd.Series:
        """Return a QE curve of the sensor.

        Parameters
        ----------
        name : str
            Name of the curve, such as ``"Y"``.

        Returns
        -------
        pandas.Series
            QE, 0 to 1; the index is nm.

        Raises
        ------
        SweepError
            If the sensor has no such curve, with the nearest name.
        """
        return wavelength_table(self.wavelength_nm, {name: self.study.sensor.curve(name)})[name]

    @property
    def lights(self) -> pd.DataFrame:
        """Photons per nm of every signal, which integrate to one; columns are (signal type, name), the index nm."""
        from pandas import MultiIndex

        lights = self.study.lights
        table = wavelength_table(self.wavelength_nm, dict(enumerate(lights.photons)))
        keys = zip(lights.types, lights.names, strict=True)  # two files may have a column of one name
        return table.set_axis(MultiIndex.from_tuples(keys, names=["type", "signal"]), axis=1)

    def evaluate(
        self,
        *,
        cfa: str | None = None,
        scenario: str | None = None,
        base: str | None = None,
        relative_to: str | None = None,
        **filters: CurveLike | float,
    ) -> pd.DataFrame:
        """Evaluate filters, given by curve or by the parameters of the study's family, with every effect of the scene.

        Parameters
        ----------
        cfa : str, optional
            CFA of the study whose channels are replaced. Left out, the one that the study modifies in these channels.
        scenario : str, optional
            One scenario; left out, all of them.
        base : str, optional
            Curve that the filter replaces, where the study does not state it.
        relative_to : str, optional
            The values are transmissions, to be multiplied by this curve of the sensor. Left out, they are QE, but for
            those of a file that does not say so: these are transmissions of the curve that the filter replaces.
        **filters : CurveLike or number
            Curve of each modified channel, ``evaluate(N=curve)``, or rows of curves for many filters, ndarray of shape
            (n_filters, n_wavelengths). Or parameters of a family that the study has, ``evaluate(left_nm=600,
            right_nm=[640, 650])``: numbers, or as many of each for a table of designs. Without any, the plain CFAs and
            named designs are evaluated.

        Returns
        -------
        pandas.DataFrame
            One row per scenario and filter: ``name`` (a plain CFA has its own), ``cfa``, ``scenario``, parameters of
            the family, every quantity of the study, ``violation``, ``feasible`` and ``violated`` (constraints that are
            not met). ``attrs["units"][column]`` and ``attrs["meanings"][column]`` say what a quantity is. What the
            filter does not determine is NaN: figures of a plain CFA's filter, or of a curve's parameters; if one of
            them is constrained, the row is not feasible.

        Raises
        ------
        SweepError
            If a curve is not clean, a name is unknown, or a QE exceeds 1.
        """
        study = self.study
        scenarios = [known_scenario(study, scenario)] if scenario is not None else list(study.scenarios)
        if not filters:
            return evaluate_spaces(study, plain_and_named(study, cfa), scenarios)
        if are_parameters(study, filters):
            return evaluate_spaces(study, [designs_of_parameters(study, cfa, filters)], scenarios)
        channels = {name: cast(CurveLike, curve) for name, curve in filters.items()}
        factor = None if relative_to is None else study.sensor.curve(relative_to)
        chosen = find_cfa(study, list(channels)) if cfa is None else known_cfa(study, cfa, list(channels))
        bases = replaced_curves(study, chosen, list(channels), base)
        replaced = {name: study.sensor.curve(curve) for name, curve in bases.items()}
        rows = {
            name: filter_on_grid(name, curve, study.grid, replaced[name], factor) for name, curve in channels.items()
        }
        if len({len(curves) for curves in rows.values()}) > 1:
            counts = {name: len(curves) for name, curves in rows.items()}
            raise SweepError(ValidationIssue("different numbers of filters", value=counts))
        curves = np.stack([*rows.values()], axis=1)
        return evaluate_spaces(study, [designs_of_curves(study, chosen, bases, curves)], scenarios)

    def upper_bound(
        self,
        *,
        cfa: str | None = None,
        channel: str | None = None,
        scenario: str | None = None,
        sensitivity: float | None = None,
    ) -> UpperBound:
        """Compute the upper bound on the CSD of any filter in a channel.

        It holds for filters between the least transmission and the curve that they replace, under the study's
        constraints, before clipping and quantization.

        Parameters
        ----------
        cfa, channel : str, optional
            Modified channel; left out, the one of the search.
        scenario : str, optional
            Scenario; left out, the first one.
        sensitivity : float, optional
            Least sensitivity of the filters, in addition to the study's constraints.

        Returns
        -------
        UpperBound
            ``.proven``, the upper bound, DN; ``.attained`` and ``.curve``, the CSD and QE of a filter near it;
            ``.left_out``, constraints that the bound does not use.

        Raises
        ------
        SweepError
            If there is no such upper bound, with the reason.
        """
        space = self._modified(cfa, channel)
        assert space.filter is not None
        scene = next(iter(self.study.scenarios)) if scenario is None else known_scenario(self.study, scenario)
        problem = any_filter_search(self.study, self.study.setup(space, scene))
        if sensitivity is not None:
            if isinstance(sensitivity, str) or not 0 <= sensitivity <= 1:
                raise SweepError(
                    ValidationIssue("no share of the light", key="sensitivity", value=sensitivity, allowed="0 to 1")
                )
            problem = with_lower_bound(problem, "sensitivity", sensitivity)
        limit, reason = upper_bound_or_reason(problem)
        if limit is None:
            raise SweepError(ValidationIssue(f"no upper bound: {reason}"))
        return limit

    def plan(self, tolerance_dn: float | None = None) -> LoadedStudy:
        """Return the study with a plan of effects for each scenario.

        Parameters
        ----------
        tolerance_dn : float, optional
            Tolerance of any CSD, DN; left out, that of the study.

        Returns
        -------
        LoadedStudy
            Its `evaluate` computes only the effects that the tolerance calls for; its `plans` state what is left out
            and why.
        """
        if isinstance(tolerance_dn, str) or (tolerance_dn is not None and not 0 <= tolerance_dn < np.inf):
            raise SweepError(
                ValidationIssue("no tolerance", key="tolerance_dn", value=tolerance_dn, allowed="0 DN or more")
            )
        return LoadedStudy(self.study.with_plans(tolerance_dn))

    @property
    def plans(self) -> Mapping[str, Plan]:
        """What is left out of each scenario, and why; empty before `plan`."""
        return self.study.plans

    def run(self, output: Path | str = "outputs", jobs: int | None = None) -> FinishedRun:
        """Run the study and draw its report; finished work of an earlier run is kept.

        Parameters
        ----------
        output : path-like
            Folder in which a folder with the name of the study is made.
        jobs : int, optional
            Worker processes; left out, one per core.

        Returns
        -------
        FinishedRun
            The finished run.

        Raises
        ------
        SweepError
            As `sweep run` reports it.
        """
        from .run import run_loaded

        return FinishedRun(Path(run_loaded(self.study, Path(output), jobs)))

    def _modified(self, cfa: str | None, channel: str | None) -> Space:
        """Return the design space of the search, or the first that has the CFA and channel."""
        spaces = [s for s in self.study.spaces if s.filter is not None]
        searched = [] if self.study.search is None else [self.study.search.space]
        for space in (*searched, *spaces):
            assert space.filter is not None
            if cfa in (None, space.cfa) and (channel is None or channel in space.filter.channels):
                return space
        known = sorted({name for s in spaces if s.filter is not None for name in s.filter.channels})
        near = None if channel is None else nearest(channel, known)
        allowed = ", ".join(known) or "a study with a design, sweep or box"
        raise SweepError(
            ValidationIssue("the study modifies no such channel", value=channel, allowed=allowed, nearest=near)
        )


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
    234.1
    """

    def __init__(self, folder: Path, data: Path | None = None, *, allow_code: bool = False) -> None:
        from ..report import read_output
        from ..results.manifest import Manifest

        self.folder, self._data, self._allow_code = folder, data, allow_code
        self.output: Output = read_output(self.folder)
        for line in Manifest(self.folder).notes:
            warnings.warn(line, stacklevel=3)

    def __fspath__(self) -> str:
        return str(self.folder)

    def __repr__(self) -> str:
        return f"<run {self.output.study.study}: {self.output.provenance.filters:,} filters in {self.folder}>"

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.summary)}</pre>"

    @cached_property
    def table(self) -> pd.DataFrame:
        """Result table with one row per design and scenario; units and meanings are in ``attrs``."""
        import pyarrow as pa

        from ..results.manifest import Manifest

        columns: Mapping[str, Column] = self.output.columns
        return with_units(pa.concat_tables(Manifest(self.folder).batches()).unify_dictionaries().to_pandas(), columns)

    @property
    def best(self) -> pd.Series:
        """Best feasible design that was swept or searched; raises SweepError if there is none."""
        if self.output.best.empty:
            raise OutputError(
                ValidationIssue("the run has no feasible design that was swept or searched", str(self.folder))
            )
        best = self.output.best.iloc[0].dropna()
        return best.rename(best["design_id"])

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
