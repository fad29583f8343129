"""Handovers of an HDR pixel: the number of a series at which a capture is full."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from ..base.types import Array, DesignCurves, Float, FloatArray, MemberNumbers, delayed
from ..camera.linear import linear_model
from ..camera.noise.merge import limits_dn
from ..camera.setup import Setup
from ..results.tables import HANDOVERS
from ..study import Study
from ..study.axes import series_of
from .analysis import Calls, designs_between, table_of_calls
from .between import Between

if TYPE_CHECKING:
    import pandas as pd

_CLOSE = 1e-6
_SCHEMA = pa.schema(
    [(name, pa.string()) for name in ("name", "series", "key", "channel", "signal_type")]
    + [("capture", pa.int64()), ("at", pa.float64())]
)


def _calls(study: Study, rows: pd.DataFrame) -> Calls:
    """Find where the median signal of each type fills the captures of each channel.

    One row per series of scenarios (`series`, `key`), design, channel, signal type and capture (from 1 on): `at` is the
    number at which the expected reading reaches the capture's threshold, or saturation for the last one; -inf or inf if
    it is below or above all numbers of the series.
    """
    for design in designs_between(study, rows):
        numbers = np.array([*design.numbers.values()])
        yield design.key, delayed(_handovers, design.setup, design.scenes, design.curves, numbers)


def _handovers(
    setup: Setup, scenes: Between, curves: DesignCurves, numbers: Float[Array, " numbers"]
) -> list[dict[str, Any]]:
    """Return rows of the table without their keys."""
    pixel, known, handovers = setup.camera.pixel, dict[float, FloatArray](), []

    def electrons(number: float) -> Float[Array, "signals channels"]:
        """Return expected electrons, the mean over phases, field positions and moments."""
        if number not in known:
            model = linear_model(scenes.at(number))
            dn, once = model.smooth(curves)[0].mean(axis=0), model.setup.camera.pixel
            known[number] = (dn - once.offset_dn) / once.dn_per_e
        return known[number]

    for at, channel in enumerate(setup.camera.mosaic.channels):
        for kind, members in setup.members.items():

            def typical_e(number: float, at: int = at, members: MemberNumbers = members) -> float:
                return float(np.median(electrons(number)[members, at]))

            for number, (capture, readout, limit) in enumerate(
                zip(pixel.captures, pixel.read_as, limits_dn(pixel), strict=True), 1
            ):
                full_e = readout.saturation_e if limit is None else (limit - readout.offset_dn) / readout.dn_per_e
                share = full_e / (capture.light * capture.qe_factor.get(channel, 1.0))
                row = {"channel": channel, "signal_type": kind, "capture": number}
                handovers.append(row | {"at": _reached(numbers, typical_e, share)})
    return handovers


def _reached(numbers: Float[Array, " numbers"], value: Callable[[float], float], limit: float) -> float:
    """Return the first number at which ascending values reach a limit."""
    from scipy.optimize import brentq  # noqa: PLC0415  (few studies ask for it)

    above = np.array([value(number) >= limit for number in numbers])
    if not above.any():
        return float("inf")
    at = int(above.argmax())
    if at == 0:
        return float("-inf")
    low, high = (float(number) for number in numbers[at - 1 : at + 1])
    if min(low, value(low)) > 0:  # on a line in the logarithms without background and dark current
        number = low * (high / low) ** (np.log(limit / value(low)) / np.log(value(high) / value(low)))
        if abs(value(number) / limit - 1) < _CLOSE:
            return float(number)
    return float(brentq(lambda number: value(number) - limit, low, high, rtol=_CLOSE))


def _is_asked(study: Study) -> bool:
    return bool(study.section.pixel.captures and series_of(study.scenarios))


CAPTURES_FULL = table_of_calls(HANDOVERS, "handovers of captures", _is_asked, lambda _: _SCHEMA, _calls)
