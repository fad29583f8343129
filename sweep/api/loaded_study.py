"""A checked study as a Python object."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ..base.errors import SweepError, ValidationIssue, nearest
from ..designs.space import Space
from ..designs.ungridded import PairedDesigns
from ..metrics.bound import total_violation
from ..metrics.quantity import Quantity
from ..search.limit import Limit
from ..study import Study, folder_name
from .inline_curves import CurveLike, on_grid, wavelength_table
from .user_filters import (
    any_filter_problem,
    evaluate_curves,
    find_cfa,
    replaced_curves,
    table_of_results,
    upper_bound_or_reason,
    user_filter_setup,
    with_lower_bound,
)

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from .finished_run import FinishedRun


OWN = "own"
"""Name of designs that are no part of the study."""


class LoadedStudy:
    """A checked study, which evaluates filters, bounds them, and runs.

    Parameters
    ----------
    study : Study
        The study as the other subpackages use it.

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
        """Photons per nm of every signal, normalized to a sum of one; columns are (signal type, name), the index nm."""
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
            The values are transmissions, to be multiplied by this curve of the sensor. Left out, they are QE.
        **filters : CurveLike or number
            Curve of each modified channel, ``evaluate(N=curve)``, or rows of curves for many filters, ndarray of shape
            (n_filters, n_wavelengths). Or parameters of a family that the study has, ``evaluate(left_nm=600,
            right_nm=[640, 650])``: numbers, or as many of each for a table of designs. Without any, the plain CFAs and
            named designs are evaluated.

        Returns
        -------
        pandas.DataFrame
            One row per scenario and filter, with every quantity of the study; units and meanings are in ``attrs``.
            Quantities that only the parameters of a family determine are NaN; if one of them is constrained, the filter
            is not feasible.

        Raises
        ------
        SweepError
            If a curve is not clean, a name is unknown, or a QE exceeds 1.
        """
        study = self.study
        scenarios = [self._scenario(scenario)] if scenario is not None else list(study.scenarios)
        if not filters:
            return self._plain_and_named(cfa, scenarios)
        if self._of_family(filters):
            return self._evaluate_spaces([self._own_designs(cfa, filters)], scenarios)
        channels = {name: cast(CurveLike, curve) for name, curve in filters.items()}
        factor = 1.0 if relative_to is None else study.sensor.curve(relative_to)
        rows = {
            name: on_grid(name, curve, study.grid, "sensor" if relative_to is None else "filter") * factor
            for name, curve in channels.items()
        }
        if len({len(curves) for curves in rows.values()}) > 1:
            counts = {name: len(curves) for name, curves in rows.items()}
            raise SweepError(ValidationIssue("different numbers of filters", value=counts))
        chosen = find_cfa(study, list(channels)) if cfa is None else self._cfa(cfa, list(channels))
        bases = replaced_curves(study, chosen, list(channels), base)
        curves = np.stack([*rows.values()], axis=1)
        columns = {s: evaluate_curves(study, user_filter_setup(study, chosen, s, bases), curves) for s in scenarios}
        return table_of_results(study, [(OWN, chosen, name, values) for name, values in columns.items()])

    def _plain_and_named(self, cfa: str | None, scenarios: list[str]) -> pd.DataFrame:
        from ..results.tables import NAMED, REFERENCE

        study = self.study
        spaces = [s for s in study.spaces if s.kind in (REFERENCE, NAMED) and cfa in (None, s.cfa)]
        if not spaces:
            known = list(dict.fromkeys(s.cfa for s in study.spaces if s.kind in (REFERENCE, NAMED)))
            near = None if cfa is None else nearest(cfa, known)
            raise SweepError(
                ValidationIssue("no plain CFA or named design", value=cfa, allowed=", ".join(known), nearest=near)
            )
        return self._evaluate_spaces(spaces, scenarios)

    def _evaluate_spaces(self, spaces: Sequence[Space], scenarios: Sequence[str]) -> pd.DataFrame:
        from ..run.routes import quantities_at
        from ..run.rows import rules_of

        study, rules, rows = self.study, rules_of(self.study), []
        for name in scenarios:
            for space in spaces:
                points = space.points(0, space.size)
                numbers, setup = np.arange(space.size), study.setup(space, name)
                values, issues = quantities_at(space, numbers, setup, rules, rules.wanted)
                for text in issues.values():
                    raise SweepError(ValidationIssue(f"{space.name} in {name}: {text}"))
                worst = total_violation(values, study.constraints, space.violation(points))
                unknown = np.full(space.size, np.nan)  # of a lamp that is not pulsed in this scenario
                columns = dict(zip(space.parameters, points.T, strict=True)) if space.name == OWN else {}
                columns |= {quantity: values.get(quantity, unknown) for quantity in study.quantities}
                rows.append((space.name, space.cfa, name, columns | {"violation": worst}))
        return table_of_results(study, rows)

    def _of_family(self, filters: Mapping[str, object]) -> bool:
        """Return whether filters are given by parameters of a family; raises SweepError for curves beside them."""
        parameters = {name for space in self.study.spaces for name in space.parameters}
        channels = filters.keys() - parameters
        if len(channels) in (0, len(filters)):
            numbers = [name for name in channels if isinstance(filters[name], int | float | np.number)]
            if numbers and parameters:
                raise SweepError(_unknown("parameter", numbers[0], sorted(parameters)))
            return not channels
        raise SweepError(_unknown("parameter", min(channels), sorted(parameters)))

    def _own_designs(self, cfa: str | None, parameters: Mapping[str, Any]) -> Space:
        """Return designs of a family of the study: that of the search, or the first with these parameters."""
        searched = [] if self.study.search is None else [self.study.search.space]
        spaces = [s for s in (*searched, *self.study.spaces) if s.filter is not None and cfa in (None, s.cfa)]
        space = next((s for s in spaces if parameters.keys() <= set(s.parameters)), None)
        if space is None or space.filter is None:
            allowed = "; ".join(dict.fromkeys(f"{s.cfa}: {', '.join(s.parameters)}" for s in spaces)) or "none"
            problem = f"no filter of the study{f' on {cfa}' if cfa else ''} has these parameters together"
            raise SweepError(ValidationIssue(problem, value=list(parameters), allowed=allowed))
        axes = []
        for parameter in space.filter.family.parameters:
            stated = parameters.get(parameter.name, parameter.default)
            if stated is None:
                allowed = f"{parameter.low:g} to {parameter.high:g}"
                raise SweepError(ValidationIssue("missing", key=parameter.name, allowed=allowed))
            values = np.atleast_1d(np.asarray(stated, dtype=float)).ravel()
            outside = values[~((values >= parameter.low) & (values <= parameter.high))]
            if outside.size or not values.size:
                allowed = f"{parameter.low:g} to {parameter.high:g}"
                value = outside[:1].tolist()
                raise SweepError(ValidationIssue("out of range", key=parameter.name, value=value, allowed=allowed))
            axes.append(tuple(values.tolist()))
        size = max(map(len, axes))
        if {len(axis) for axis in axes} - {1, size}:
            counts = {p: len(axis) for p, axis in zip(space.parameters, axes, strict=True)}
            raise SweepError(ValidationIssue("as many values of each parameter, or one", value=counts))
        return Space("design", OWN, space.cfa, space.filter, tuple(axes), gridded=False, rows=PairedDesigns(size))

    def limit(
        self,
        *,
        cfa: str | None = None,
        channel: str | None = None,
        scenario: str | None = None,
        sensitivity: float | None = None,
    ) -> Limit:
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
        Limit
            ``.proven``, the upper bound, DN; ``.attained`` and ``.curve``, the CSD and QE of a filter near it;
            ``.left_out``, constraints that the bound does not use.

        Raises
        ------
        SweepError
            If there is no such upper bound, with the reason.
        """
        space = self._modified(cfa, channel)
        assert space.filter is not None
        scene = next(iter(self.study.scenarios)) if scenario is None else self._scenario(scenario)
        problem = any_filter_problem(self.study, self.study.setup(space, scene))
        if sensitivity is not None:
            problem = with_lower_bound(problem, "sensitivity", sensitivity)
        limit, reason = upper_bound_or_reason(problem)
        if limit is None:
            raise SweepError(ValidationIssue(f"no limit: {reason}"))
        return limit

    def plot(self, **channels: CurveLike) -> Figure:
        """Draw the sensor's QE over the spectra of the lights.

        Parameters
        ----------
        **channels : CurveLike
            Further curves to draw, by name.

        Returns
        -------
        matplotlib.figure.Figure
            The figure.
        """
        from ..report.figures import CurvesFigure, draw_curves

        study = self.study
        user = {name: on_grid(name, curve, study.grid) for name, curve in channels.items()}
        members = study.lights.members
        peak_one = study.lights.photons / study.lights.photons.max(axis=1, keepdims=True)
        shades = {kind: peak_one[at].max(axis=0) for kind, at in members.items()}
        curves = {**study.sensor.qe, **{f"{name} (own)": rows for name, rows in user.items()}}
        title = f"Quantum efficiency, {study.sensor.name}"
        return draw_curves(CurvesFigure(title, "QE", study.grid.nodes_nm, curves, shades=shades))

    def plan(self, tolerance_dn: float | None = None) -> LoadedStudy:
        """Return the study with a plan of effects for each scenario.

        Parameters
        ----------
        tolerance_dn : float, optional
            Tolerance of any CSD, DN; left out, that of the study.

        Returns
        -------
        LoadedStudy
            Its `evaluate` computes only the effects that the tolerance calls for; ``study.plans`` states what is left
            out and why.
        """
        return LoadedStudy(self.study.with_plans(tolerance_dn))

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
        from ..report import make_report, read_output
        from ..results.identity import run_facts
        from ..run import output_folder, run_study
        from .finished_run import FinishedRun

        folder, _ = output_folder(Path(output) / folder_name(self.name), run_facts(self.study))
        run_study(self.study, folder, jobs or os.cpu_count() or 1, _silent, ("sweep", "from Python"))
        make_report(read_output(folder), repair=True)
        return FinishedRun(folder)

    def _scenario(self, name: str) -> str:
        known = list(self.study.scenarios)
        if name not in known:
            raise SweepError(
                ValidationIssue("unknown scenario", value=name, allowed=", ".join(known), nearest=nearest(name, known))
            )
        return name

    def _cfa(self, name: str, channels: list[str]) -> str:
        known = [cfa for cfa, mosaic in self.study.mosaics.items() if set(channels) <= set(mosaic.channels)]
        if name not in known:
            problem = f"no CFA of the study with a channel {' and '.join(channels)}"
            raise SweepError(
                ValidationIssue(problem, value=name, allowed=", ".join(known), nearest=nearest(name, self.cfas))
            )
        return name

    def _modified(self, cfa: str | None, channel: str | None) -> Space:
        """Return the design space of the search, or the first that has the CFA and channel."""
        spaces = [s for s in self.study.spaces if s.filter is not None]
        searched = [] if self.study.search is None else [self.study.search.space]
        for space in (*searched, *spaces):
            assert space.filter is not None
            if cfa in (None, space.cfa) and (channel is None or channel in space.filter.channels):
                return space
        raise SweepError(
            ValidationIssue("the study modifies no such channel", value=channel, allowed="a design, sweep or box")
        )


def _silent(*_: object) -> None: ...


def _unknown(what: str, name: str, known: Sequence[str]) -> ValidationIssue:
    return ValidationIssue(f"unknown {what}", value=name, allowed=", ".join(known), nearest=nearest(name, known))
