"""Worst values over sampling phases, field positions and moments of a pulse: of a lattice, then refined.

Values that readings alone determine are refined from a finer lattice of phases, where kinks of full pixels are seen;
those under noise, and those of lamps of any brightness, which cost more, from the lattice of the scene.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import SweepError, ValidationIssue
from ..base.types import Array, Bool, BoolArray, Float, PerDesign, SameShape
from ..camera.axis import Axis, Search
from ..camera.electrons import View
from ..camera.light import Pulsed
from ..camera.memory import blocks
from ..camera.model import SceneModel
from ..camera.phases import axis_of, phases_at
from .quantity import BEST_PHASE, DN, Columns, Quantity

HEIGHT_ROUNDS = 4
_TOGETHER = 64
"""Designs that are refined side by side."""
_FLAT_DN, _FLAT_STEPS_DN, _FLAT = 0.05, 1.0, 3e-4
"""A start whose neighbors all differ from it by less is refined no further; the second where whole numbers step, the
third, relative, of other values."""
_MOST = 1e300
"""In place of infinity, and of values that are not known at a place, so that differences are numbers."""
_LARGEST_Z = 40.0
_Places = Float[Array, "places axes"]
_Asked = Bool[BoolArray, "designs places"]
_Values = Float[Array, "designs values places"]
Quantities = Mapping[str, Quantity]


@dataclass(frozen=True)
class Sought:
    """Columns of designs whose worst values are sought, and how they are read.

    `read`: from a design and a model to these columns of the design alone in its cases; `fine`: from a finer lattice of
    phases than the scene's; `best`: numbers of columns whose largest value at a place is sought, too.
    """

    designs: tuple[int, ...]
    names: tuple[str, ...]
    read: Callable[[int, SceneModel], Columns]
    fine: bool = False
    best: tuple[int, ...] = ()


def over_cases(model: SceneModel, cases: Columns, quantities: Quantities) -> Columns:
    """Return the worst of all cases, and for CSDs the largest over the places of the smallest over the moments."""
    best = {quantity.of: name for name, quantity in quantities.items() if quantity.extreme == "best place"}
    columns: Columns = {}
    for name, values in cases.items():
        if name not in quantities:
            raise SweepError(ValidationIssue("a metric gives a column that is none of its `quantities`", value=name))
        if len(values) == 1:
            columns |= {column: values[0].copy() for column in (name, best.get(name)) if column is not None}
            continue
        moments = quantities[name].worse(np.swapaxes(values.reshape(model.n_cases, -1, values.shape[1]), 0, 1))
        columns[name] = quantities[name].worse(moments)
        if name in best:
            columns[best[name]] = moments.max(axis=0)
    return columns


def can_refine(model: SceneModel) -> bool:
    """Return whether a scene has an axis between whose places values may be worse."""
    setup = model.setup
    fine = setup.accuracy.finest_phase_px > 0
    return model.light.bends or (fine and (setup.all_phases or setup.all_heights))


def refine(
    sought: Sought, model: SceneModel, exposure_s: PerDesign, cases: Columns, columns: Columns, quantities: Quantities
) -> None:
    """Put values refined over phases, field positions and moments into columns, and the largest at a place.

    `cases`: columns in the scene's own cases.
    """
    for start in range(0, len(sought.designs), _TOGETHER):
        block = replace(sought, designs=sought.designs[start : start + _TOGETHER])
        _Refinement(model, block, exposure_s, cases, quantities).put(columns)


def oriented(quantity: Quantity, values: SameShape) -> SameShape:
    """Return values of which less is worse; of errors the distance in units of the noise that stands for them."""
    if quantity.scale == "log10":
        from scipy.special import ndtri  # noqa: PLC0415  (slow to import: kept off the start-up path)

        values = -np.clip(ndtri(values), -_LARGEST_Z, _LARGEST_Z)
    elif quantity.direction == "less":
        values = -values
    return np.clip(np.where(np.isnan(values), _MOST, values), -_MOST, _MOST)


def _of_oriented(quantity: Quantity, value: float) -> float:
    if quantity.scale == "log10":
        from scipy.special import ndtr  # noqa: PLC0415  (slow to import: kept off the start-up path)

        return float(ndtr(-value)) if value < _LARGEST_Z else 0.0
    return -value if quantity.direction == "less" else value


@dataclass(frozen=True)
class _Refinement:
    """Values of some designs that are refined side by side: those sought, then the negatives of the best."""

    model: SceneModel
    sought: Sought
    exposure_s: PerDesign
    cases: Columns
    quantities: Quantities

    def put(self, columns: Columns) -> None:
        """Put refined values into columns."""
        model, setup = self.model, self.model.setup
        fine, pulsed = setup.accuracy.finest_phase_px > 0, model.light.bends
        if setup.all_phases and fine:
            axis = axis_of(setup, finer=self.sought.fine)
            if self.sought.fine:
                everywhere = np.ones((len(self.sought.designs), len(axis.places)), dtype=bool)
                known = self._at_phases(axis.places, everywhere)
            else:
                values = self._both_ends(self._own().min(axis=(2, 4)))
                known = values[:, :, phases_at(setup, axis.places)[1]].min(axis=2)
            values, places = self._searched(axis, known, self._at_phases)
            if pulsed:
                values = self._at_worst_moments(values, places)
            self._put(columns, values, best=True)
        elif pulsed and not setup.all_heights:
            every = range(len(self.sought.designs))
            values = np.stack([self._over_pulse(number, model.own_views) for number in every])
            self._put(columns, values, best=model.n_cases == 1)
        if setup.all_heights and fine:
            heights = np.array(model.heights)
            known = self._both_ends(self._own().min(axis=(3, 4)))
            values, _ = self._searched(Axis.along(heights, HEIGHT_ROUNDS), known, self._at_heights)
            self._put(columns, values, best=model.n_cases == heights.size)

    def _put(self, columns: Columns, found: Float[Array, "designs values"], *, best: bool) -> None:
        """Put the smallest of each value, where it is smaller than what is known, and the largest, into the columns."""
        of, n = self.sought, len(self.sought.names)
        for design, values in zip(of.designs, found.tolist(), strict=True):
            for name, value in zip(of.names, values, strict=False):
                if value < oriented(self.quantities[name], columns[name][design : design + 1])[0]:
                    columns[name][design] = _of_oriented(self.quantities[name], value)
            for number, value in zip(of.best if best else (), values[n:], strict=False):
                columns[BEST_PHASE + of.names[number]][design] = -value

    def _read(self, number: int, model: SceneModel) -> Float[Array, "values cases"]:
        values = self.sought.read(self.sought.designs[number], model)
        return np.stack([oriented(self.quantities[name], values[name][:, 0]) for name in self.sought.names])

    def _both_ends(self, values: Float[Array, "*batch values places"]) -> Float[Array, "*batch ends places"]:
        return np.concatenate([values, -values[..., list(self.sought.best), :]], axis=-2)

    def _own(self) -> Float[Array, "designs values heights phases moments"]:
        """Return values in the scene's own cases."""
        of, model = self.sought, self.model
        by_name = [oriented(self.quantities[name], self.cases[name][:, list(of.designs)]) for name in of.names]
        values = np.moveaxis(np.stack(by_name), 2, 0)
        heights = len(model.heights)
        return values.reshape(*values.shape[:2], heights, model.n_cases // heights, -1)

    def _searched(
        self, axis: Axis, known: _Values, at: Callable[[_Places, _Asked], _Values]
    ) -> tuple[Float[Array, "designs values"], Float[Array, "designs values axes"]]:
        """Return the smallest values along an axis, and their places."""
        of, setup = self.sought, self.model.setup
        names = [*of.names, *(of.names[number] for number in of.best)]
        in_dn = np.array([self.quantities[name].unit == DN for name in names])
        flat = _FLAT * np.abs(known).min(axis=2)
        if of.fine:
            steps = setup.scene.noise is None and setup.computes("quantization")
            flat = np.where(in_dn, _FLAT_STEPS_DN if steps else _FLAT_DN, flat)
        else:
            flat = np.maximum(flat, _FLAT_DN * in_dn)
        return Search(axis, at, known, flat).run()

    def _at_phases(self, places: _Places, asked: _Asked) -> _Values:
        """Return values at sampling phases, the smallest over field positions and moments."""
        setup, heights = self.model.setup, len(self.model.heights)
        phases, choices = phases_at(setup, places)
        values = np.full((len(asked), len(self.sought.names) + len(self.sought.best), len(phases)), np.inf)
        begin = 0
        for block in [phases] if setup.linear else blocks(setup, phases):
            views = [*self.model.views(block)]
            for number in np.flatnonzero(asked.any(axis=1)).tolist():
                wanted = np.unique(choices[:, asked[number]]) - begin
                wanted = wanted[(wanted >= 0) & (wanted < len(block))]
                if wanted.size:
                    there = self._read(number, self.model.at([view.subset(wanted) for view in views]))
                    of_phases = there.reshape(len(there), heights, wanted.size, -1).min(axis=(1, 3))
                    values[number, :, begin + wanted] = self._both_ends(of_phases).T
            begin += len(block)
        return np.asarray(values[:, :, choices].min(axis=2))

    def _at_heights(self, heights: _Places, asked: _Asked) -> _Values:
        """Return values at field positions, the smallest over phases and moments."""
        values = np.full((len(asked), len(self.sought.names) + len(self.sought.best), len(heights)), np.inf)
        for at, height in enumerate(heights[:, 0].tolist()):
            there = self.model.at([*self.model.views(heights=[height])])
            for number in np.flatnonzero(asked[:, at]).tolist():
                least = self._read(number, there).min(axis=1)
                values[number, :, at] = self._both_ends(least[:, None])[:, 0]
        return values

    def _at_worst_moments(
        self, values: Float[Array, "designs values"], places: Float[Array, "designs values axes"]
    ) -> Float[Array, "designs values"]:
        """Return values at the worst moment of a pulse, at the place of each."""
        worst, n = values.copy(), len(self.sought.names)
        for number, of_values in enumerate(places):
            distinct, which = np.unique(of_values, axis=0, return_inverse=True)
            for at, place in enumerate(distinct):
                phases = phases_at(self.model.setup, place[None])[0]
                views = [*self.model.views(phases)]
                there, here = self._over_pulse(number, views), which.ravel() == at
                worst[number, :n] = np.where(here[:n], np.minimum(values[number, :n], there[:n]), worst[number, :n])
                worst[number, n:] = np.where(here[n:], np.maximum(values[number, n:], there[n:]), worst[number, n:])
        return worst

    def _over_pulse(self, number: int, views: Sequence[View]) -> Float[Array, " values"]:
        """Return the smallest values of one design at any moment of a pulse over some views."""

        def at(moments: _Places, _: _Asked) -> _Values:
            values = self._read(number, self.model.at(views, moments[:, 0]))
            return np.asarray(values.reshape(1, len(values), -1, len(moments)).min(axis=2))

        assert isinstance(self.model.light, Pulsed)
        axis = self.model.light.axis(self.exposure_s[self.sought.designs[number]])
        least = Search(axis, at, at(axis.places, np.ones((1, len(axis.places)), dtype=bool))).run()[0]
        return self._both_ends(least[0, :, None])[:, 0]
