"""Flicker of a pulsed lamp in the captures of an HDR pixel: modulation, visibility and false hue over the phases."""

from __future__ import annotations

import numpy as np

from ...base.types import FloatArray
from ...camera.forward import ForwardModel
from ...camera.pwm import phases_of
from ..chromatic import squared_distance
from ..metric import PulseMetric
from ..quantity import DN, Columns, Quantity, RequestedQuantities

MODULATION, LAMP_SEEN, FALSE_HUE = "flicker_modulation", "lamp_seen", "false_hue_dn"
_BETWEEN = 7
"""Phases between two at which an exposure begins or ends with a pulse."""
_SEEN_DN = 1.0


class Flicker(PulseMetric):
    """Changes of a lamp's readout with the phase of its pulses, which is uniform."""

    order = 6
    names = (MODULATION, LAMP_SEEN, FALSE_HUE)

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        if not requested.flicker:
            return ()
        return (
            Quantity(
                name=MODULATION,
                metric=MODULATION,
                meaning="flicker modulation of a pulsed lamp: (most - least) / (most + least) of its brightest channel "
                "over all phases of its pulses (IEEE P2020), for the lamp with most",
                wanted="less",
                ends=("max",),
                digits=3,
            ),
            Quantity(
                name=LAMP_SEEN,
                metric=LAMP_SEEN,
                meaning="share of the phases of its pulses in which a lamp's brightest channel has 1 DN or more above "
                "the readout without lamps, for the lamp with least",
                wanted="more",
                ends=("min",),
                digits=3,
            ),
            Quantity(
                name=FALSE_HUE,
                metric=FALSE_HUE,
                meaning="false hue of a pulsed lamp: the largest chromatic distance, as of `chromatic_csd_<a>_<b>`, "
                "between its color at a phase of its pulses and its mean color",
                unit=DN,
                wanted="less",
                ends=("max",),
                digits=1,
            ),
        )

    def of_pulses(self, model: ForwardModel, curves: FloatArray) -> Columns:
        """Compute the columns, design by design, since phases depend on the exposure."""
        exposure_s, rows = model.light.exposure_s(curves), []
        for one, time_s in zip(curves, exposure_s, strict=True):
            pulsed = model.setup.computes("flicker")
            phases = phases_of(model.setup, np.array([time_s]), _BETWEEN)[0] if pulsed else np.zeros(1)
            response = model.at(model.phases, phases).read(one[None])[0][0]
            dark = model.unlit(one[None], np.array([time_s]))[0]
            lit = response.reshape(model.n_cases, phases.size, *response.shape[1:])
            lit = lit - dark.reshape(model.n_cases, -1, dark.shape[-1])[:, :1, None]
            rows.append(_of_phases(lit, phases))
        return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _of_phases(lit: FloatArray, phases: FloatArray) -> dict[str, float]:
    """Return columns from the readout above that without lamps, [n_places, n_phases, n_signals, n_channels]."""
    widths = np.diff(np.concatenate([phases, phases[:1] + 1]))
    after = np.roll(lit, -1, axis=1)
    mean = ((lit + after) / 2 * widths[:, None, None]).sum(axis=1)
    brightest = mean.argmax(axis=-1)
    of_lamp = np.take_along_axis(lit, brightest[:, None, :, None], axis=-1)[..., 0]  # [n_places, n_phases, n_signals]
    most, least = of_lamp.max(axis=1), np.maximum(of_lamp.min(axis=1), 0.0)
    modulation = np.divide(most - least, most + least, out=np.ones_like(most), where=most > 0)
    next_lamp = np.roll(of_lamp, -1, axis=1)
    step = np.abs(next_lamp - of_lamp)
    higher, lower = np.maximum(of_lamp, next_lamp), np.minimum(of_lamp, next_lamp)
    part = np.divide(higher - _SEEN_DN, step, out=(higher >= _SEEN_DN).astype(float), where=step > 0)
    part = np.where(lower >= _SEEN_DN, 1.0, np.clip(part, 0.0, 1.0))
    hue = np.sqrt(squared_distance(lit, np.broadcast_to(mean[:, None], lit.shape)))
    return {
        MODULATION: float(modulation.max()),
        LAMP_SEEN: float((part * widths[:, None]).sum(axis=1).min()),
        FALSE_HUE: float(hue.max()),
    }
