"""Evaluation of a batch of designs in a scene: every column of light and filters."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.types import (
    Array,
    Bool,
    BoolArray,
    DesignCases,
    DesignCurves,
    DesignParameters,
    Float,
    PerValue,
)
from ..camera.electrons import Changing
from ..camera.field import field_heights, refined_heights, setup_at
from ..camera.forward import ForwardModel, forward_model
from ..camera.phases import Phases, fine_lattice, refined_minima
from ..camera.pwm import phases_of
from ..camera.setup import Setup
from ..designs.block import Block, CurveBlock
from ..designs.family import Family
from ..spectra.lights import Pair, class_pairs, pair_name
from ..vision.section import Vision
from .brightness import curves_of
from .columns.chromatic import (
    CHROMATIC_CSD,
    CHROMATIC_DPRIME,
    CHROMATIC_ERROR,
    ChromaticSeparation,
    with_equal_brightness,
)
from .columns.color_separation import ColorSeparation
from .columns.exposure import EXPOSURE
from .metric import (
    DesignMetric,
    FamilyMetric,
    LampMetric,
    Metric,
    NoiseMetric,
    PulseMetric,
    ReadoutMetric,
    VisionMetric,
)
from .quantity import BEST_PHASE, Columns, Quantity, RequestedQuantities
from .registry import METRICS, quantities_of
from .separation import csd_name, separations, separations_along
from .user_metrics import UserMetric, user_quantities

_FINER_MOMENTS, _PULSE_ROUNDS, _PULSE_STEPS = 8, 3, 9
"""Factor by which moments of a pulse are finer at one phase; rounds in which the worst is refined; moments of each."""
_AT_ONCE = 1024
"""Designs that differ in one channel alone and are read at once, so that their readout stays in the cache."""
_COMPARED_AT_ONCE = 1024
"""Readouts of a design in a case that are compared at once."""
_READ_AT_ONCE = 2**19
"""Digital numbers that other metrics are given at once: 4 MiB, so that they stay in the cache."""
_CSD = next(metric for metric in METRICS if isinstance(metric, ColorSeparation))
_CHROMATIC = next(metric for metric in METRICS if isinstance(metric, ChromaticSeparation))
_ALONG = (_CSD, _CHROMATIC)
"""Metrics of the readout that take the one channel in which designs differ."""
_Unlit = Callable[[slice], Float[Array, "designs cases channels"]]
_LAMPS = [metric for metric in METRICS if isinstance(metric, LampMetric)]


@dataclass(frozen=True)
class _Request:
    """What a batch is evaluated for: chromatic pairs, metrics of readouts, of noise between states, and of users."""

    pairs: tuple[Pair, ...]
    readouts: Sequence[ReadoutMetric]
    noisy: Sequence[NoiseMetric]
    states: Sequence[str]
    user_metrics: Sequence[UserMetric]
    probabilities: bool


def designed_quantities(setup: Setup, designs: DesignCurves | Block, metrics: Collection[Metric] = METRICS) -> Columns:
    """Return the quantities of designs without light."""
    block = _block(designs)
    return _joined([metric.of_designs(setup, block) for metric in metrics if isinstance(metric, DesignMetric)])


def family_quantities(
    family: Family | None, points: DesignParameters, metrics: Collection[Metric] = METRICS
) -> Columns:
    """Return the quantities that the parameters of designs determine.

    `family`: family; None for plain CFAs.
    """
    return _joined([metric.of_parameters(family, points) for metric in metrics if isinstance(metric, FamilyMetric)])


def image_quantities(
    setup: Setup, curves: DesignCurves, vision: Vision | None, seed: int, metrics: Collection[Metric] = METRICS
) -> Columns:
    """Return the quantities of images of signal heads.

    `vision`: benchmark; None if the study has none.
    """
    if vision is None:
        return {}
    of_images = [metric for metric in metrics if isinstance(metric, VisionMetric)]
    return _joined([metric.of_images(setup, curves, vision, seed) for metric in of_images])


def _block(designs: DesignCurves | Block) -> Block:
    return CurveBlock(np.asarray(designs, dtype=float)) if isinstance(designs, np.ndarray) else designs


def _joined(parts: Sequence[Columns]) -> Columns:
    return {name: values for part in parts for name, values in part.items()}


def _csd_names(setup: Setup) -> list[str]:
    return [csd_name(pair) for pair in class_pairs(setup.lights.classes)]


def _by_phase(model: ForwardModel, cases: Columns, n_places: int) -> Float[Array, "designs pairs places"]:
    """Return CSDs at each phase or field position, the smallest over the moments."""
    names = _csd_names(model.setup)
    distances = np.stack([cases[name] for name in names])  # [n_pairs, n_cases x n_moments, n_designs]
    return np.moveaxis(distances.reshape(len(names), n_places, -1, distances.shape[-1]).min(axis=2), -1, 0)


def _csds(model: ForwardModel, curves: Float[Array, "1 modified wavelengths"]) -> Float[Array, "pairs phases"]:
    """Return CSDs of one design at each phase, the smallest over the moments."""
    response = model.read(curves)[0]
    cases = {csd_name(pair): dn[:, None] for pair, dn in separations(response[0], model.setup.members).items()}
    return np.asarray(_by_phase(model, cases, model.n_cases)[0])


def _nonlinear_over_pulse(setup: Setup) -> bool:
    """Return whether a CSD may be smallest at any moment of a pulse.

    Of whole numbers: only where they may clip, too, and the worst places are refined.
    """
    drive, rounds = setup.scene.drive, setup.scene.noise is None and setup.computes("quantization")
    clips = setup.computes("saturation") and setup.accuracy.finest_phase_px > 0
    bends = not setup.linear and (not rounds or clips)
    return drive is not None and setup.computes("flicker") and bends


def _over_pulse(
    model: ForwardModel, curves: Float[Array, "1 modified wavelengths"], pairs: Sequence[int], phases: Phases | None
) -> Float[Array, " pairs"]:
    """Return the smallest CSDs of some pairs of one design at one phase over field positions and moments of a pulse."""

    def distances(moments: Float[Array, " moments"]) -> list[Float[Array, " moments"]]:
        response = model.at(phases, moments).read(curves)[0][0]
        at_places = separations(response, model.setup.members).values()
        return [values.reshape(-1, moments.size).min(axis=0) for values in at_places]

    finer = _FINER_MOMENTS * (model.setup.accuracy.pwm_moments - 1)
    first = np.linspace(0.0, 1.0, finer + 1)
    if model.setup.camera.pixel.captures:
        first = phases_of(model.setup, model.light.exposure_s(curves), finer)[0]
    at_first = distances(first)
    smallest = np.array([at_first[pair].min() for pair in pairs])
    for number, pair in enumerate(pairs):
        moments, worst = first, int(at_first[pair].argmin())
        for _ in range(_PULSE_ROUNDS):
            if not 0 < worst < len(moments) - 1:
                break
            moments = np.linspace(moments[worst - 1], moments[worst + 1], _PULSE_STEPS)
            values = distances(moments)[pair]
            worst = int(values.argmin())
            smallest[number] = min(smallest[number], values[worst])
    return smallest


def _refine_moments(model: ForwardModel, block: Block, columns: Columns) -> None:
    """Refine the smallest distances over the moments of a pulse in the columns, for one phase."""
    names = _csd_names(model.setup)
    for design in np.flatnonzero(np.isfinite(columns[names[0]])):
        curves = block.subset(slice(design, design + 1)).curves()
        for name, least in zip(names, _over_pulse(model, curves, range(len(names)), model.phases), strict=True):
            for column in {name, BEST_PHASE + name if model.n_cases == 1 else name} & columns.keys():
                columns[column][design] = min(columns[column][design], least)


def _refine_phases(model: ForwardModel, block: Block, columns: Columns) -> None:
    """Refine the extremes over all sampling phases in the columns."""
    setup = model.setup
    if not setup.accuracy.finest_phase_px:
        return
    names = _csd_names(setup)
    lattice, step_px = fine_lattice(setup)
    on_lattice = model.at(lattice)
    for design in np.flatnonzero(np.isfinite(columns[names[0]])):
        curves = block.subset(slice(design, design + 1)).curves()

        def both_ends(at_phases: ForwardModel, curves: DesignCurves = curves) -> Float[Array, "designs pairs"]:
            csds = _csds(at_phases, curves)
            return np.concatenate([csds, -csds])

        extremes, at = refined_minima(
            setup, lattice, step_px, both_ends(on_lattice), lambda phases: both_ends(model.at(phases))
        )
        smallest, largest = np.split(extremes, 2)
        for number, name in enumerate(names):
            columns[name][design] = smallest[number]
            columns[BEST_PHASE + name][design] = -largest[number]
            if _nonlinear_over_pulse(setup):
                for column, end in ((name, number), (BEST_PHASE + name, number + len(names))):
                    there = _over_pulse(model, curves, [number], at.subset(np.array([end])))[0]
                    columns[column][design] = min(columns[column][design], there)


def _refine_heights(model: ForwardModel, block: Block, cases: Columns, columns: Columns) -> None:
    """Refine the extreme distances over all field positions in the columns; the largest of a single phase alone."""
    setup = model.setup
    names, heights = _csd_names(setup), field_heights(setup)
    if not setup.accuracy.finest_phase_px:
        return
    at_heights = _by_phase(model, cases, len(heights))
    best = [BEST_PHASE + name for name in names if model.n_cases == len(heights) and BEST_PHASE + name in columns]
    for design in np.flatnonzero(np.isfinite(at_heights).all(axis=(1, 2))):
        curves = block.subset(slice(design, design + 1)).curves()

        def at_height(height: float, curves: DesignCurves = curves) -> PerValue:
            csds = _csds(forward_model(setup_at(setup, height)), curves).min(axis=1)
            return np.concatenate([csds, -csds]) if best else csds

        known = at_heights[design]
        extremes, _ = refined_heights(heights, np.concatenate([known, -known]) if best else known, at_height)
        for name, least in zip(names, extremes, strict=False):
            columns[name][design] = least
        for name, largest in zip(best, -extremes[len(names) :], strict=True):
            columns[name][design] = largest


def _whole_readout(
    model: ForwardModel, request: _Request, n: int, read: Callable[[slice], DesignCases], unlit: _Unlit
) -> Columns:
    """Return columns of n designs by metrics of users, and by those of the readout that have no way along a channel.

    `read`, `unlit`: the readout of a part of the designs, and the response without lamps.
    """
    setup, readouts, user_metrics = model.setup, request.readouts, request.user_metrics
    # A CFA of which an own metric says nothing says so of one design, and no more are read for it.
    first = user_quantities(user_metrics, setup, read(slice(0, 1))) if user_metrics else {}
    columns = {name: np.full(n, values[0]) for name, values in first.items()}
    present = [metric for metric in user_metrics if np.isfinite(first[metric.name][0])]
    if present or readouts:
        values_per_design = model.n_cases * len(setup.lights.names) * len(setup.camera.mosaic.channels)
        step, parts = max(1, _READ_AT_ONCE // values_per_design), []
        for start in range(0, n, step):
            part = slice(start, start + step)
            response = read(part)
            cases = by_case(setup, response, readouts, unlit(part)) if readouts else {}
            parts.append(over_cases(model, cases) | user_quantities(present, setup, response))
        columns |= {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return columns


def by_case(
    setup: Setup,
    response: DesignCases,
    metrics: Sequence[ReadoutMetric],
    unlit: Float[Array, "designs cases channels"] | None = None,
) -> Columns:
    """Evaluate metrics of the readout in each case, in blocks of the size of a cache.

    `unlit`: response without lamps, DN; left out, 0.
    """
    n_designs, n_cases = response.shape[:2]
    step, parts = max(1, _COMPARED_AT_ONCE // max(1, n_designs)), []
    for start in range(0, n_cases, step):
        cases = np.swapaxes(response[:, start : start + step], 0, 1)
        readouts, columns = cases.reshape(-1, *cases.shape[2:]), Columns()
        dark = np.zeros((len(readouts), readouts.shape[2]))
        if unlit is not None:
            dark = np.swapaxes(unlit[:, start : start + step], 0, 1).reshape(dark.shape)
        for metric in metrics:
            columns |= metric.of_readout(setup, readouts, dark)
        parts.append(columns)
    return {name: np.concatenate([part[name] for part in parts]).reshape(n_cases, n_designs) for name in parts[0]}


def over_cases(model: ForwardModel, cases: Columns) -> Columns:
    """Return the worst of all cases, and for CSDs the largest over the phases of the smallest over the moments."""
    quantities = quantities_of(RequestedQuantities(model.setup.lights.classes, any_place=True))
    best = {quantity.of: name for name, quantity in quantities.items() if quantity.extreme == "best place"}
    columns: Columns = {}
    for name, values in cases.items():
        if len(values) == 1:
            columns |= {column: values[0].copy() for column in (name, best.get(name)) if column is not None}
            continue
        moments = quantities[name].worse(np.swapaxes(values.reshape(model.n_cases, -1, values.shape[1]), 0, 1))
        columns[name] = quantities[name].worse(moments)
        if name in best:
            columns[best[name]] = moments.max(axis=0)
    return columns


def evaluate(
    model: ForwardModel,
    designs: DesignCurves | Block,
    states: Sequence[str] = (),
    *,
    probabilities: bool = False,
    user_metrics: Sequence[UserMetric] = (),
    metrics: Collection[Metric] = METRICS,
    chromatic: Sequence[Pair] | None = None,
) -> Columns:
    """Evaluate a batch of designs as the camera reads them out.

    `metrics`: those whose columns are wanted, beside the CSDs; `chromatic`: the pairs whose chromatic CSD is wanted;
    left out, all of them.

    CSDs are the smallest over sampling phases, field positions and moments of a pulse; ``best_phase_csd_<a>_<b>`` is
    the largest over the phases of the smallest over the moments. Where all phases or field positions count, CSDs are
    refined; other metrics are the worst over the lattice.
    """
    block, setup = _block(designs), model.setup
    pairs = class_pairs(setup.lights.classes) if chromatic is None else chromatic
    noisy = [metric for metric in metrics if isinstance(metric, NoiseMetric) and states]
    readouts = [metric for metric in metrics if isinstance(metric, ReadoutMetric) and metric not in _ALONG]
    request = _Request(tuple(pairs), readouts, noisy, states, [*user_metrics], probabilities)
    changing = None if noisy else model.read_changing(block)
    if changing is None:
        cases, columns = _read(model, block, request, metrics)
    elif changing.which.all():
        cases, columns = _along(model, changing, request)
    else:
        rest = block.subset(np.flatnonzero(~changing.which))
        parts = _along(model, changing, request), _read(model, rest, request, metrics)
        cases, columns = (
            {name: _merged(changing.which, along[name], others[name]) for name in along}
            for along, others in zip(*parts, strict=True)
        )
    columns |= _over_brightness(setup, block, columns, request, metrics)
    if setup.all_phases:
        _refine_phases(model, block, columns)
    elif _nonlinear_over_pulse(setup) and not setup.all_heights:
        _refine_moments(model, block, columns)
    if setup.all_heights:
        _refine_heights(model, block, cases, columns)
    return columns | designed_quantities(setup, block, metrics)


def _over_brightness(
    setup: Setup, block: Block, columns: Columns, request: _Request, metrics: Collection[Metric]
) -> Columns:
    """Return columns of lamps of unknown brightness by their brightness curves.

    Those of noise, and others where a column is missing: no closed form holds there.
    """
    walked, refined, states = np.zeros(len(columns[EXPOSURE]), dtype=bool), Columns(), request.states
    for name in map(_chromatic_name, request.pairs):
        walked |= np.isnan(columns[name])
        refined[name] = columns[name].copy()
    of_states = [metric for metric in metrics if isinstance(metric, LampMetric) and metric.of_states and states]
    if not (walked.any() or of_states):
        return {}
    for pair in class_pairs(list(states if of_states else ())):
        refined |= {pair_name(of, pair): np.full(len(walked), np.nan) for of in (CHROMATIC_DPRIME, CHROMATIC_ERROR)}
    for design in range(len(walked)):
        requested = [*of_states, *([_CHROMATIC] if walked[design] else [])]
        curves = block.subset(slice(design, design + 1)).curves()
        if not (requested and np.isfinite(curves).all() and np.isfinite(columns[EXPOSURE][design])):
            continue
        for name, value in of_lamps(setup, curves, states, requested, request.pairs).items():
            refined[name][design] = value
    return refined | (with_equal_brightness(columns | refined, states) if of_states else {})


def of_lamps(
    setup: Setup,
    curves: DesignCurves,
    states: Sequence[str],
    metrics: Sequence[LampMetric],
    pairs: Sequence[Pair] = (),
) -> dict[str, float]:
    """Return columns of lamps of unknown brightness of one design, of pairs of types and of states."""
    cases = curves_of(forward_model(setup.over_brightness).lamps(curves), setup)
    columns: dict[str, float] = {}
    for metric in metrics:
        columns |= metric.of_lamps(cases, setup.members, class_pairs(list(states)) if metric.of_states else pairs)
    return columns


def evaluate_some(
    model: ForwardModel, curves: DesignCurves, quantities: Sequence[Quantity], states: Sequence[str]
) -> dict[str, float]:
    """Return quantities of one design, by no more than their own metrics where these need none of the other columns."""
    requested = {quantity.metric for quantity in quantities}
    if requested == {CHROMATIC_DPRIME}:
        found = of_lamps(model.setup, curves, states, [metric for metric in _LAMPS if metric.of_states])
    else:
        pulses = [metric for metric in METRICS if isinstance(metric, PulseMetric) and requested <= {*metric.names}]
        columns = pulses[0].of_pulses(model, curves) if pulses else evaluate(model, curves, states)
        found = {name: float(values[0]) for name, values in columns.items()}
    return {quantity.name: found[quantity.name] for quantity in quantities}


def _merged(
    which: Bool[BoolArray, " designs"], selected: Float[Array, " ..."], others: Float[Array, " ..."]
) -> Float[Array, " ..."]:
    """Merge values of designs, the last axis, from two groups."""
    merged = np.empty((*selected.shape[:-1], which.size))
    merged[..., which], merged[..., ~which] = selected, others
    return merged


def _along(model: ForwardModel, changing: Changing, request: _Request) -> tuple[Columns, Columns]:
    """Return CSDs in each case, and the columns, of designs that differ in one channel alone."""
    n, csds = int(changing.which.sum()), _csd_names(model.setup)
    cases = {name: np.empty((len(changing.fixed), n)) for name in (*csds, *map(_chromatic_name, request.pairs))}
    for start in range(0, n, _AT_ONCE):
        batch = slice(start, start + _AT_ONCE)
        values, unlit = changing.make(batch), changing.unlit(batch)
        for case, fixed in enumerate(changing.fixed):
            along = fixed, changing.channel, values[:, case]
            for pair, distance in separations_along(*along, model.setup.members).items():
                cases[csd_name(pair)][case, batch] = distance
            for name, distance in _CHROMATIC.along(model.setup, *along, unlit[:, case], request.pairs).items():
                cases[name][case, batch] = distance
    columns = over_cases(model, cases) | _whole_readout(model, request, n, changing.whole_of, changing.unlit)
    return {name: cases[name] for name in csds}, columns | {EXPOSURE: np.full(n, changing.exposure_s)}


def _read(model: ForwardModel, block: Block, request: _Request, metrics: Collection[Metric]) -> tuple[Columns, Columns]:
    """Return CSDs in each case, and the columns, of any designs; with `noisy` metrics, those of noise, too."""
    curves, setup, by_design = block.curves(), model.setup, Columns()
    if request.noisy:
        read = model.read_with_noise(curves)
        response, exposure_s = read.mean, read.exposure_s
        confused = {name: setup.members[name] for name in request.states}
        noisy = [metric for metric in request.noisy if request.probabilities or not metric.extra]
        by_design = _joined([metric.of_noise(model, curves, read, confused) for metric in noisy])
    else:
        response, exposure_s = model.read(curves)

    def unlit(part: slice) -> Float[Array, "designs cases channels"]:
        return model.unlit(curves[part], exposure_s[part])

    by_design |= _whole_readout(model, request, len(curves), response.__getitem__, unlit)
    if setup.scene.drive is not None and setup.camera.pixel.captures:
        pulsed = [metric for metric in metrics if isinstance(metric, PulseMetric)]
        by_design |= _joined([metric.of_pulses(model, curves) for metric in pulsed])
    cases = by_case(setup, response, [_CSD])
    if request.pairs:
        chromatic = by_case(setup, response, [_CHROMATIC], unlit(slice(None)))
        by_design |= over_cases(model, {name: chromatic[name] for name in map(_chromatic_name, request.pairs)})
    return cases, over_cases(model, cases) | by_design | {EXPOSURE: exposure_s}


def _chromatic_name(pair: Pair) -> str:
    return pair_name(CHROMATIC_CSD, pair)
