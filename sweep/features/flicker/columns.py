"""Flicker of a pulsed lamp in the captures of an HDR pixel: modulation, visibility and false hue over the phases."""

from __future__ import annotations

import numpy as np

from ...base.types import Array, Float
from ...camera.brightness import LampReadings
from ...camera.light import Light
from ...camera.model import scene_model
from ...camera.pwm import phases_of
from ...camera.setup import Setup
from ...metrics.batch import Batch
from ...metrics.chromatic import squared_distance
from ...metrics.metric import Metric
from ...metrics.quantity import DN, Columns, Quantity, RequestedQuantities

MODULATION, LAMP_SEEN, FALSE_HUE = "flicker_modulation", "lamp_seen", "false_hue_dn"
_BETWEEN, _OF_MANY, _FINER = 127, 15, 33
"""Phases between two at which an exposure begins or ends with a pulse, so many that a capture's handover is seen, which
is as narrow as its noise; where many pixels hand over one after the other, or windows differ, whose pulses tell more
than handovers; and phases around that with the largest hue."""
_MANY = 16
_SEEN_DN = 1.0
EXAMPLE = True


class Flicker(Metric):
    """Changes of a lamp's readout with the phase of its pulses, which is uniform."""

    order = 6
    needs = "pulses"

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        if not requested.asked("flicker"):
            return ()
        return (
            Quantity(
                name=MODULATION,
                metric=MODULATION,
                meaning="flicker modulation of a pulsed lamp: (most - least) / (most + least) of its brightest channel "
                "over all phases of its pulses (IEEE P2020), for the lamp with most",
                direction="less",
                digits=3,
            ),
            Quantity(
                name=LAMP_SEEN,
                metric=LAMP_SEEN,
                meaning="share of the phases of its pulses in which a lamp's brightest channel has 1 DN or more above "
                "the readout without lamps, for the lamp with least",
                direction="more",
                digits=3,
            ),
            Quantity(
                name=FALSE_HUE,
                metric=FALSE_HUE,
                meaning="false hue of a pulsed lamp: the largest chromatic distance, as of `chromatic_csd_<a>_<b>`, "
                "between its color at a phase of its pulses and its mean color",
                unit=DN,
                direction="less",
                digits=1,
            ),
        )

    def of_batch(self, batch: Batch) -> Columns:
        """Compute the columns, design by design, since phases depend on the exposure."""
        setup, rows = batch.setup, []
        steady, light = scene_model(setup.steady), batch.model.light
        for design, time_s in zip(batch.curves, batch.exposure_s, strict=True):
            rows.append([_of_lamps(lamps, setup, light, time_s) for lamps in steady.lamps(design[None])])
        worst = {MODULATION: max, LAMP_SEEN: min, FALSE_HUE: max}
        return {name: np.array([of(place[name] for place in row) for row in rows]) for name, of in worst.items()}


def _of_lamps(lamps: LampReadings, setup: Setup, light: Light, time_s: float) -> dict[str, float]:
    """Return the columns at one sampling phase and field position, with the largest hue refined between the phases."""

    def lit(phases: Float[Array, " phases"]) -> Float[Array, "phases signals channels"]:
        scales = light.scales(np.array([time_s]), phases)[:, 0]
        return np.asarray(lamps.means_of_exposures(scales) - dark, dtype=float)

    dark = lamps.means_of_exposures(np.zeros((len(lamps.lit_e), 1)))
    pulsed = setup.computes("flicker")
    windows = {(of.capture.start_ratio, of.capture.exposure_ratio) for of in setup.camera.pixel.exposures}
    between = _OF_MANY if lamps.lit_e.shape[2] > _MANY or len(windows) > 1 else _BETWEEN
    phases = phases_of(setup, np.array([time_s]), between)[0] if pulsed else np.zeros(1)
    readings, widths = lit(phases), np.diff(np.concatenate([phases, phases[:1] + 1]))
    after = np.roll(readings, -1, axis=0)
    mean = ((readings + after) / 2 * widths[:, None, None]).sum(axis=0)
    brightest = np.take_along_axis(readings, mean.argmax(axis=-1)[None, :, None], axis=-1)[..., 0]
    most, least = brightest.max(axis=0), np.maximum(brightest.min(axis=0), 0.0)
    modulation = np.divide(most - least, most + least, out=np.ones_like(most), where=most > 0)
    following = np.roll(brightest, -1, axis=0)
    step = np.abs(following - brightest)
    higher, lower = np.maximum(brightest, following), np.minimum(brightest, following)
    part = np.divide(higher - _SEEN_DN, step, out=(higher >= _SEEN_DN).astype(float), where=step > 0)
    part = np.where(lower >= _SEEN_DN, 1.0, np.clip(part, 0.0, 1.0))

    def hue(of_phases: Float[Array, "phases _signals _channels"]) -> Float[Array, " phases"]:
        distances = np.sqrt(squared_distance(of_phases, np.broadcast_to(mean, of_phases.shape)))
        return np.asarray(distances.max(axis=1), dtype=float)

    hues = hue(readings)
    worst = int(hues.argmax())
    low, high = phases[worst] - widths[worst - 1], phases[worst] + widths[worst]
    finer = hue(lit(np.linspace(low, high, _FINER))) if pulsed else hues
    return {
        MODULATION: float(modulation.max()),
        LAMP_SEEN: float((part * widths[:, None]).sum(axis=0).min()),
        FALSE_HUE: float(max(hues.max(), finer.max())),
    }
