"""A study and a finished run as objects: what the command line does, from Python."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.errors import Fault, OutputError, SweepError, nearest
from ..designs.space import Space
from ..metrics.bound import total_violation
from ..metrics.quantity import Column, Quantity
from ..search.limit import Limit
from ..study import Study, folder_name
from .given import CurveLike, on_grid, over_nm
from .own_filters import (
    any_filter,
    at_least,
    bases_of,
    cfa_with,
    judged,
    limit_or_reason,
    setup_with,
    table_of,
    with_units,
)

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from ..report import Output


class LoadedStudy:
    """A checked study: what it holds, what any filter is worth in it, and its run.

    >>> import sweep
    >>> study = sweep.load_study("stopband")
    >>> table = study.evaluate(N=0.9 * study.curve("Y"))
    >>> f"{table.csd_yellow_red[0]:.0f} DN at a sensitivity of {table.sensitivity[0]:.2f}"
    '35 DN at a sensitivity of 0.90'

    `study`: the same as the other rooms of the package know it.
    """

    def __init__(self, study: Study) -> None:
        self.study = study

    def __repr__(self) -> str:
        return f"<study {self.name}: {self.study.n_designs:,} designs on {', '.join(self.cfas)}>"

    @property
    def name(self) -> str:
        """The study's name."""
        return self.study.name

    @property
    def cfas(self) -> tuple[str, ...]:
        """Names of its CFAs."""
        return tuple(self.study.mosaics)

    @property
    def wavelength_nm(self) -> np.ndarray:
        """The wavelengths that all curves are on, nm."""
        return self.study.grid.nodes_nm

    @property
    def quantities(self) -> Mapping[str, Quantity]:
        """What a table of its designs holds: name -> unit, meaning, and what constraints may say of it."""
        return self.study.quantities

    @property
    def curves(self) -> pd.DataFrame:
        """QE of the sensor, a column per curve; the index is nm."""
        return over_nm(self.wavelength_nm, self.study.sensor.qe)

    def curve(self, name: str) -> pd.Series:
        """A QE curve of the sensor; the index is nm. Raises SweepError, with the nearest name, where there is none."""
        return over_nm(self.wavelength_nm, {name: self.study.sensor.curve(name)})[name]

    @property
    def lights(self) -> pd.DataFrame:
        """Photons per nm of every signal, each of one photon in all; columns are (signal type, name), the index nm."""
        from pandas import MultiIndex

        lights = self.study.lights
        table = over_nm(self.wavelength_nm, dict(enumerate(lights.photons)))
        keys = zip(lights.types, lights.names, strict=True)  # two files may have a column of one name
        return table.set_axis(MultiIndex.from_tuples(keys, names=["type", "signal"]), axis=1)

    def evaluate(
        self,
        *,
        cfa: str | None = None,
        scenario: str | None = None,
        base: str | None = None,
        relative_to: str | None = None,
        **channels: CurveLike,
    ) -> pd.DataFrame:
        """Every quantity of own filters, given by channel: `evaluate(N=curve)`, or rows of curves for many filters.

        Without a channel: of the plain CFAs and named designs. The values are QE, or, with `relative_to`, transmissions
        times that curve of the sensor. `base`: the curve that the filter replaces, where the study does not say it. Its
        technology is that of the study's own filters. A row per scene and filter; units and meanings are in `attrs`.
        All effects are computed. What only a family's parameters say is NaN, and where it is constrained, no filter is
        feasible. Raises SweepError for curves that are not clean, names that are unknown, and a QE above 1.
        """
        study = self.study
        scenarios = [self._scenario(scenario)] if scenario is not None else list(study.scenarios)
        if not channels:
            return self._own(cfa, scenarios)
        factor = 1.0 if relative_to is None else study.sensor.curve(relative_to)
        rows = {name: on_grid(name, curve, study.grid) * factor for name, curve in channels.items()}
        if len({len(each) for each in rows.values()}) > 1:
            raise SweepError(Fault("different numbers of filters", value={n: len(each) for n, each in rows.items()}))
        chosen = cfa_with(study, list(channels)) if cfa is None else self._cfa(cfa, list(channels))
        bases = bases_of(study, chosen, list(channels), base)
        curves = np.stack([*rows.values()], axis=1)
        setups = {name: setup_with(study, chosen, name, bases) for name in scenarios}
        found = {name: judged(study, setup, curves) for name, setup in setups.items()}
        return table_of(study, [("own", chosen, n, columns) for n, columns in found.items()])

    def _own(self, cfa: str | None, scenarios: list[str]) -> pd.DataFrame:
        """The study's plain CFAs and named designs."""
        from ..results.tables import NAMED, PLAIN
        from ..run.routes import found_of
        from ..run.rows import rules_of

        study, rules = self.study, rules_of(self.study)
        spaces = [s for s in study.spaces if s.kind in (PLAIN, NAMED) and cfa in (None, s.cfa)]
        if not spaces:
            known = list(dict.fromkeys(s.cfa for s in study.spaces if s.kind in (PLAIN, NAMED)))
            near = None if cfa is None else nearest(cfa, known)
            raise SweepError(Fault("no plain CFA or named design", value=cfa, allowed=", ".join(known), nearest=near))
        rows = []
        for name in scenarios:
            for space in spaces:
                points = space.points(0, space.size)
                values, faults = found_of(space, 0, points, study.setup(space, name), rules)
                for text in faults.values():
                    raise SweepError(Fault(f"{space.name} in {name}: {text}"))
                worst = total_violation(values, study.constraints, space.violation(points))
                columns = {quantity: values[quantity] for quantity in study.quantities}
                rows.append((space.name, space.cfa, name, columns | {"violation": worst}))
        return table_of(study, rows)

    def limit(
        self,
        *,
        cfa: str | None = None,
        channel: str | None = None,
        scenario: str | None = None,
        sensitivity: float | None = None,
    ) -> Limit:
        """What no filter in a channel exceeds: `.proven`, and `.curve`, the QE of a filter that attains `.attained`.

        It is for filters between the least transmission and the curve that they replace, under the study's constraints
        (but those that `.left_out` names, such as bounds on widths of edges), before clipping and quantization;
        `sensitivity` asks for at least so much of it. Raises SweepError where there is no such limit, and says why.
        """
        space = self._modified(cfa, channel)
        assert space.filter is not None
        scene = next(iter(self.study.scenarios)) if scenario is None else self._scenario(scenario)
        problem = any_filter(self.study, self.study.setup(space, scene))
        if sensitivity is not None:
            problem = at_least(problem, "sensitivity", sensitivity)
        found, reason = limit_or_reason(problem)
        if found is None:
            raise SweepError(Fault(f"no limit: {reason}"))
        return found

    def plot(self, **channels: CurveLike) -> Figure:
        """Draw the sensor's QE over the lights, with own curves over them: `plot(N=curve)`. A Matplotlib figure."""
        from ..report.figures import CurvesFigure, draw_curves

        study = self.study
        own = {name: on_grid(name, curve, study.grid) for name, curve in channels.items()}
        members = study.lights.members
        peak_one = study.lights.photons / study.lights.photons.max(axis=1, keepdims=True)
        shades = {kind: peak_one[at].max(axis=0) for kind, at in members.items()}
        curves = {**study.sensor.qe, **{f"{name} (own)": rows for name, rows in own.items()}}
        title = f"Quantum efficiency, {study.sensor.name}"
        return draw_curves(CurvesFigure(title, "QE", study.grid.nodes_nm, curves, shades=shades))

    def plan(self, tolerance_dn: float | None = None) -> LoadedStudy:
        """The study with a plan for each of its scenes: the effects that `tolerance_dn` calls for, and no others.

        Then `evaluate` computes by it, and `study.plans` says what it left out and why.
        """
        return LoadedStudy(self.study.with_plans(tolerance_dn))

    def run(self, output: Path | str = "outputs", jobs: int | None = None) -> FinishedRun:
        """Run the study into `output`/<name>, draw its report, and give the finished run; what is finished stays.

        `jobs`: worker processes, all cores if left out. Raises SweepError as the command says it.
        """
        from ..report import make_report, read_output
        from ..run import output_folder, run_study

        folder, _ = output_folder(Path(output) / folder_name(self.name), self.study)
        run_study(self.study, folder, jobs or os.cpu_count() or 1, _silent, ("sweep", "from Python"))
        make_report(read_output(folder), mend=True)
        return FinishedRun(folder)

    def _scenario(self, name: str) -> str:
        known = list(self.study.scenarios)
        if name not in known:
            raise SweepError(
                Fault("unknown scenario", value=name, allowed=", ".join(known), nearest=nearest(name, known))
            )
        return name

    def _cfa(self, name: str, channels: list[str]) -> str:
        known = [cfa for cfa, mosaic in self.study.mosaics.items() if set(channels) <= set(mosaic.channels)]
        if name not in known:
            problem = f"no CFA of the study with a channel {' and '.join(channels)}"
            raise SweepError(Fault(problem, value=name, allowed=", ".join(known), nearest=nearest(name, self.cfas)))
        return name

    def _modified(self, cfa: str | None, channel: str | None) -> Space:
        """The space whose channel is meant: by the search, or the first that fits."""
        spaces = [s for s in self.study.spaces if s.filter is not None]
        searched = [] if self.study.search is None else [self.study.search.space]
        for space in (*searched, *spaces):
            assert space.filter is not None
            if cfa in (None, space.cfa) and (channel is None or channel in space.filter.channels):
                return space
        raise SweepError(Fault("the study modifies no such channel", value=channel, allowed="a design, sweep or box"))


class FinishedRun:
    """What a run left in its folder.

    >>> import sweep
    >>> run = sweep.read_run("outputs/stopband")  # doctest: +SKIP
    >>> run.best.csd_yellow_red  # doctest: +SKIP
    233.8

    `output`: the same as the report knows it.
    """

    def __init__(self, folder: Path, data: Path | None = None, *, allow_code: bool = False) -> None:
        from ..report import read_output

        self.folder, self._data, self._allow_code = folder, data, allow_code
        self.output: Output = read_output(self.folder)

    def __repr__(self) -> str:
        return f"<run {self.output.study.study}: {self.output.provenance.filters:,} filters in {self.folder}>"

    @cached_property
    def table(self) -> pd.DataFrame:
        """The whole result table; units and meanings of its quantities are in `attrs`."""
        from ..results.tables import RESULTS, read_table

        columns: Mapping[str, Column] = self.output.columns
        return with_units(read_table(self.folder / RESULTS).to_pandas(), columns)

    @property
    def best(self) -> pd.Series:
        """The best feasible design that was swept or searched; raises SweepError where there is none."""
        if self.output.best.empty:
            raise OutputError(Fault("the run has no feasible design that was swept or searched", str(self.folder)))
        return self.output.best.iloc[0].dropna()

    @property
    def curves(self) -> pd.DataFrame:
        """QE that the run kept, the index is nm: columns (`sensor`, curve), and (design_id, channel) of its filters."""
        kept = self.output.curves
        columns: dict[tuple[Any, str], np.ndarray] = {("sensor", name): curve for name, curve in kept.sensor.items()}
        columns |= {(i, channel): curve for i, own in kept.designs.items() for channel, curve in own.items()}
        table = over_nm(kept.wavelength_nm, columns)
        table.columns.names = ["design", "curve"]
        return table

    @cached_property
    def study(self) -> LoadedStudy:
        """The study that was run, with the very curves that the run kept."""
        from ..report import study_of

        return LoadedStudy(study_of(self.output, self._data, allow_code=self._allow_code))

    @property
    def summary(self) -> str:
        """What the run found, as the command says it."""
        from ..report import summary_lines

        return "\n".join(summary_lines(self.output))

    def report(self) -> Path:
        """Draw figures and report again; the page's path."""
        from ..report import make_report
        from ..results.tables import REPORT

        make_report(self.output)
        return self.folder / REPORT


def _silent(*_: object) -> None: ...
