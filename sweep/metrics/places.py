"""Worst values over sampling phases, field positions and moments of a pulse: of a lattice, then refined.

Values that readings alone determine are refined from a finer lattice of phases, where kinks of full pixels are seen;
those under noise, and those of lamps of any brightness, which cost more, from the lattice of the scene.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.errors import SweepError, ValidationIssue
from ..base.types import Array, Float, PerValue, SameShape
from ..camera.memory import blocks
from ..camera.model import SceneModel, View
from ..camera.phases import lattice_of, phases_at
from ..camera.pwm import phases_of
from ..camera.refine import Lattice, in_lockstep, search
from ..camera.setup import Setup
from .quantity import BEST_PHASE, DN, Columns, Quantity

_FINER_MOMENTS, _MOMENT_ROUNDS, _MOMENTS_FINER = 8, 3, 4
"""Factor by which moments of a pulse are finer at one place; rounds around the worst, each so many times finer."""
HEIGHT_ROUNDS = 4
_TOGETHER = 64
"""Designs that are refined side by side."""
_FLAT_DN, _FLAT_STEPS_DN, _FLAT = 0.05, 1.0, 3e-4
"""A start whose neighbors all differ from it by less is refined no further; the second where whole numbers step, the
third, relative, of other values."""
_MOST = 1e300
"""In place of infinity, and of values that are not known at a place, so that differences are numbers."""
_LARGEST_Z = 40.0
_Values = Float[Array, "values _places"]
_Extremes = tuple[PerValue, Float[Array, "values axes"]]
_At = Callable[[list[int], list[Float[Array, "_places axes"]]], list[_Values]]
Quantities = Mapping[str, Quantity]


@dataclass(frozen=True)
class Sought:
    """Columns of a design whose worst values are sought, and how they are read.

    `read`: from a model to these columns of the design alone in its cases; `fine`: from a finer lattice of phases than
    the scene's; `best`: numbers of columns whose largest value at a place is sought, too.
    """

    design: int
    exposure_s: float
    names: tuple[str, ...]
    read: Callable[[SceneModel], Columns]
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


def can_refine(setup: Setup) -> bool:
    """Return whether a scene has an axis between whose places values may be worse."""
    fine = setup.accuracy.finest_phase_px > 0
    return bends_over_pulse(setup) or (fine and (setup.all_phases or setup.all_heights))


def refine(
    sought: Sequence[Sought], model: SceneModel, cases: Columns, columns: Columns, quantities: Quantities
) -> None:
    """Put values refined over phases, field positions and moments into columns, and the largest at a place.

    `cases`: columns in the scene's own cases.
    """
    for start in range(0, len(sought), _TOGETHER):
        _Refinement(model, sought[start : start + _TOGETHER], cases, quantities).put(columns)


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


def bends_over_pulse(setup: Setup) -> bool:
    """Return whether a value may be worst at any moment of a pulse.

    Of whole numbers: only where they may clip, too, and the worst places are refined.
    """
    drive, rounds = setup.scene.drive, setup.scene.noise is None and setup.computes("quantization")
    clips = setup.computes("saturation") and setup.accuracy.finest_phase_px > 0
    bends = not setup.linear and (not rounds or clips)
    return drive is not None and setup.computes("flicker") and bends


@dataclass(frozen=True)
class _Refinement:
    """Values of some designs that are refined side by side."""

    model: SceneModel
    group: Sequence[Sought]
    cases: Columns
    quantities: Quantities

    def _read(self, design: int, model: SceneModel) -> _Values:
        of = self.group[design]
        values = of.read(model)
        return np.stack([oriented(self.quantities[name], values[name][:, 0]) for name in of.names])

    def _on_lattice(self, design: int) -> _Values:
        of = self.group[design]
        return np.stack([oriented(self.quantities[name], self.cases[name][:, of.design]) for name in of.names])

    def put(self, columns: Columns) -> None:
        """Put refined values into columns."""
        model, setup, everything = self.model, self.model.setup, range(len(self.group))
        fine, pulsed = setup.accuracy.finest_phase_px > 0, bends_over_pulse(setup)
        if setup.all_phases and fine:
            extremes = self._over_phases()
            if pulsed:
                extremes = [self._pulsed(design, *extremes[design]) for design in everything]
            self._put(columns, [least for least, _ in extremes], best=True)
        elif pulsed and not setup.all_heights:
            own = [*model.own_views()]
            least = [self._both_ends(design, self._over_pulse(design, own)[:, None])[:, 0] for design in everything]
            self._put(columns, least, best=model.n_cases == 1)
        if setup.all_heights and fine:
            heights, on_lattice = np.array(model.heights), []
            for design, of in enumerate(self.group):
                of_heights = self._on_lattice(design).reshape(len(of.names), heights.size, -1).min(axis=2)
                on_lattice.append(self._both_ends(design, of_heights))
            extremes = self._extremes(Lattice.along(heights, HEIGHT_ROUNDS), on_lattice, self._at_heights)
            self._put(columns, [least for least, _ in extremes], best=model.n_cases == heights.size)

    def _put(self, columns: Columns, extremes: Sequence[PerValue], *, best: bool) -> None:
        """Put the smallest of each value, where it is smaller than what is known, and the largest, into the columns."""
        for of, found in zip(self.group, extremes, strict=True):
            for name, value in zip(of.names, found[: len(of.names)], strict=True):
                known = oriented(self.quantities[name], columns[name][of.design : of.design + 1])
                if value < known[0]:
                    columns[name][of.design] = _of_oriented(self.quantities[name], float(value))
            for number, value in zip(of.best, found[len(of.names) :], strict=True):
                if best:
                    columns[BEST_PHASE + of.names[number]][of.design] = -value

    def _both_ends(self, design: int, values: _Values) -> Float[Array, "ends _places"]:
        return np.concatenate([values, -values[list(self.group[design].best)]])

    def _flat(self, design: int, values: _Values) -> PerValue:
        of, setup = self.group[design], self.model.setup
        steps = setup.scene.noise is None and setup.computes("quantization")
        names = [*of.names, *(of.names[number] for number in of.best)]
        relative = _FLAT * np.abs(values).min(axis=1)
        absolute = np.array([_FLAT_DN * (self.quantities[name].unit == DN) for name in names])
        if of.fine:
            absolute = np.where(absolute > 0, _FLAT_STEPS_DN if steps else absolute, relative)
        return np.asarray(np.maximum(absolute, 0.0 if of.fine else relative), dtype=float)

    def _extremes(self, lattice: Lattice, on_lattice: Sequence[_Values], at: _At) -> list[_Extremes]:
        """Return the smallest values, of some the negative of the largest, too, and their places."""
        searches = [search(lattice, values, self._flat(design, values)) for design, values in enumerate(on_lattice)]
        return in_lockstep(searches, at)

    def _over_phases(self) -> list[_Extremes]:
        phases, heights = self.model.phases, len(self.model.heights)
        assert phases is not None
        lattice = lattice_of(self.model.setup, finer=self.group[0].fine)
        if self.group[0].fine:
            everything = [*range(len(self.group))]
            return self._extremes(
                lattice, self._at_phases(everything, [lattice.places] * len(everything)), self._at_phases
            )
        number = {center: at for at, center in enumerate(map(tuple, lattice.places.tolist()))}
        which = np.array([number[center] for center in map(tuple, phases.center_px.tolist())])
        on_lattice = []
        for design, of in enumerate(self.group):
            of_phases = self._on_lattice(design).reshape(len(of.names), heights, len(phases), -1).min(axis=(1, 3))
            both = self._both_ends(design, of_phases)
            least = np.full((len(lattice.places), len(both)), _MOST)
            np.minimum.at(least, which, both.T)
            on_lattice.append(least.T)
        return self._extremes(lattice, on_lattice, self._at_phases)

    def _at_phases(self, designs: list[int], places: list[Float[Array, "_places axes"]]) -> list[_Values]:
        """Return values of designs at sampling phases, over field positions and moments."""
        setup, heights = self.model.setup, len(self.model.heights)
        centers, which = np.unique(np.concatenate(places), axis=0, return_inverse=True)
        phases, choices = phases_at(setup, centers)
        ends = np.cumsum([len(of_design) for of_design in places])
        numbers_of = np.split(choices[:, which.ravel()], ends[:-1], axis=1)
        known = [np.full((len(self.group[design].names), len(phases)), np.inf) for design in designs]
        begin = 0
        for block in [phases] if setup.linear else blocks(setup, phases):
            views = [*self.model.views(block)]
            for row, design in enumerate(designs):
                wanted = np.unique(numbers_of[row]) - begin
                wanted = wanted[(wanted >= 0) & (wanted < len(block))]
                if wanted.size:
                    values = self._read(design, self.model.at([view.subset(wanted) for view in views]))
                    of_phases = values.reshape(len(values), heights, wanted.size, -1)
                    known[row][:, begin + wanted] = of_phases.min(axis=(1, 3))
            begin += len(block)
        return [
            self._both_ends(design, values)[:, numbers].min(axis=1)
            for design, values, numbers in zip(designs, known, numbers_of, strict=True)
        ]

    def _at_heights(self, designs: list[int], places: list[Float[Array, "_places axes"]]) -> list[_Values]:
        """Return values of designs at field positions, over phases and moments."""
        known: dict[tuple[int, float], PerValue] = {}
        for height in np.unique(np.concatenate(places)).tolist():
            there = self.model.at([*self.model.views(heights=[height])])
            for design, of_design in zip(designs, places, strict=True):
                if height in of_design:
                    known[design, height] = self._read(design, there).min(axis=1)
        return [
            self._both_ends(design, np.stack([known[design, height] for height in of_design[:, 0].tolist()], axis=1))
            for design, of_design in zip(designs, places, strict=True)
        ]

    def _pulsed(self, design: int, extremes: PerValue, places: Float[Array, "values axes"]) -> _Extremes:
        """Return extremes at the worst moment of a pulse, at the place of each."""
        worst, n = extremes.copy(), len(self.group[design].names)
        distinct, which = np.unique(places, axis=0, return_inverse=True)
        for number, place in enumerate(distinct):
            views = [*self.model.views(phases_at(self.model.setup, place[None])[0])]
            there = self._both_ends(design, self._over_pulse(design, views)[:, None])[:, 0]
            here = which.ravel() == number
            worst[:n] = np.where(here[:n], np.minimum(worst[:n], there[:n]), worst[:n])
            worst[n:] = np.where(here[n:], np.maximum(worst[n:], there[n:]), worst[n:])
        return worst, places

    def _over_pulse(self, design: int, views: Sequence[View]) -> PerValue:
        """Return the smallest values of one design at any moment of a pulse over some views."""
        of, setup = self.group[design], self.model.setup

        def at(_: list[int], places: list[Float[Array, "_places axes"]]) -> list[_Values]:
            moments = places[0][:, 0]
            values = self._read(design, self.model.at(views, moments))
            return [values.reshape(len(values), -1, moments.size).min(axis=1)]

        finer = _FINER_MOMENTS * (setup.accuracy.pwm_moments - 1)
        first = np.linspace(0.0, 1.0, finer + 1)
        if setup.camera.pixel.captures:
            first = phases_of(setup, np.array([of.exposure_s]), finer)[0]
        lattice = Lattice.along(first, _MOMENT_ROUNDS, _MOMENTS_FINER)
        return in_lockstep([search(lattice, at([0], [lattice.places])[0])], at)[0][0]
