"""Curves that a run keeps: a long table with one row per curve and wavelength, and the same as objects."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import pyarrow as pa

from ..base.types import Array, Float, FloatArray, PerWavelength

_QE, _LIGHT, _DESIGN, _ON_FRONT, _LIMIT = "qe", "light", "design", "front", "upper_bound"
_COLORANT = "colorant"
"""Kinds: of the sensor; of a signal; a modified channel of a design that is drawn, or of one on
the front; of the limit; the absorbance of a colorant, relative to its peak."""
_WORD = pa.dictionary(pa.int32(), pa.string())
SCHEMA = pa.schema(
    [
        pa.field("kind", _WORD, nullable=False),
        pa.field("curve", _WORD, nullable=False),
        pa.field("wavelength_nm", pa.float64(), nullable=False),
        pa.field("value", pa.float64(), nullable=False),
        pa.field("signal_type", _WORD),
        pa.field("design_id", pa.int64()),
        pa.field("channel", _WORD),
    ]
)
"""`curve`: its name, the CFA's of a limit, `<design_id> <channel>` of a design."""
FilterCurves = dict[str, FloatArray]
"""Modified channel -> QE."""


@dataclass(frozen=True)
class KeptCurves:
    """Curves of a run.

    QE of the sensor by name, photons per nm by type and name of the signal, QE of the designs that are drawn and of
    others on the front by `design_id` and channel, of the limit's filter by CFA, absorbances of colorants in the order
    of their numbers.
    """

    wavelength_nm: PerWavelength
    sensor: dict[str, PerWavelength] = field(default_factory=dict)
    lights: dict[tuple[str, str], PerWavelength] = field(default_factory=dict)
    drawn: dict[int, FilterCurves] = field(default_factory=dict)
    on_front: dict[int, FilterCurves] = field(default_factory=dict)
    limits: dict[str, PerWavelength] = field(default_factory=dict)
    colorants: dict[str, PerWavelength] = field(default_factory=dict)

    @property
    def designs(self) -> dict[int, FilterCurves]:
        """All designs whose curves were kept."""
        return {**self.drawn, **self.on_front}

    @property
    def bundles(self) -> dict[str, Float[Array, "_curves wavelengths"]]:
        """Photon spectra of each signal type."""
        types: dict[str, list[FloatArray]] = {}
        for (kind, _), photons in self.lights.items():
            types.setdefault(kind, []).append(photons)
        return {kind: np.stack(photons) for kind, photons in types.items()}

    def _rows(self) -> Iterator[tuple[str, str, PerWavelength, str | None, int | None, str | None]]:
        yield from ((_QE, name, values, None, None, None) for name, values in self.sensor.items())
        yield from ((_LIGHT, name, values, kind, None, None) for (kind, name), values in self.lights.items())
        for what, designs in ((_DESIGN, self.drawn), (_ON_FRONT, self.on_front)):
            for design_id, channels in designs.items():
                for channel, values in channels.items():
                    yield what, f"{design_id} {channel}", values, None, design_id, channel
        yield from ((_LIMIT, cfa, values, None, None, None) for cfa, values in self.limits.items())
        yield from ((_COLORANT, name, values, None, None, None) for name, values in self.colorants.items())

    def table(self) -> pa.Table:
        """Return the long table."""
        kinds, names, values, types, ids, channels = zip(*self._rows(), strict=True)
        at = np.repeat(np.arange(len(kinds)), self.wavelength_nm.size)
        columns = (
            pa.array(kinds).take(at),
            pa.array(names).take(at),
            np.tile(self.wavelength_nm, len(kinds)),
            np.concatenate(values),
            pa.array(types, pa.string()).take(at),
            pa.array(ids, pa.int64()).take(at),
            pa.array(channels, pa.string()).take(at),
        )
        return pa.table(
            [pa.array(column).cast(schema_field.type) for schema_field, column in zip(SCHEMA, columns, strict=True)],
            SCHEMA,
        )

    @classmethod
    def of_table(cls, table: pa.Table) -> KeptCurves:
        """Make the curves from the long table.

        Raises ValueError if they are not all on one grid.
        """
        table = table.select(SCHEMA.names).cast(SCHEMA)
        wavelength_nm = table["wavelength_nm"].to_numpy()
        size = len(np.unique(wavelength_nm))
        if not size or len(table) % size or (wavelength_nm.reshape(-1, size) != wavelength_nm[:size]).any():
            raise ValueError("the curves are not all on one wavelength grid")
        curves = cls(wavelength_nm[:size])
        starts = table.take(pa.array(np.arange(0, len(table), size))).to_pylist()
        for row, curve in zip(starts, table["value"].to_numpy().reshape(-1, size), strict=True):
            kind, name, owner = row["kind"], row["curve"], row["signal_type"]
            if kind in (_DESIGN, _ON_FRONT):
                designs = curves.drawn if kind == _DESIGN else curves.on_front
                designs.setdefault(row["design_id"], {})[row["channel"]] = curve
            elif kind == _LIGHT:
                curves.lights[owner, name] = curve
            else:
                {_QE: curves.sensor, _COLORANT: curves.colorants}.get(kind, curves.limits)[name] = curve
        return curves
