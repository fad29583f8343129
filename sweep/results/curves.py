"""The curves that a run keeps: a long table with a row per curve and wavelength, and the same as objects."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
import pyarrow as pa

from ..base.types import FloatArray

QE, LIGHT, TASK, DESIGN, ON_FRONT, LIMIT = "qe", "light", "task", "design", "front", "limit"
"""Kinds: of the sensor; of a signal; of an own task's file; a modified channel of a design that is drawn, or of one on
the front; of the limit."""
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
"""`curve`: its name, the CFA's of a limit, `<design_id> <channel>` of a design. `signal_type`: of a task's spectrum its
task and class."""
FilterCurves = dict[str, FloatArray]
"""Modified channel -> QE, ndarray[n_wavelengths]."""


@dataclass(frozen=True)
class KeptCurves:
    """ndarray[n_wavelengths] each: QE of the sensor by name, photons per nm by type and name of the signal, spectra of
    own tasks that are from files by task and class, and by file and column, QE of the designs that are drawn and of
    others on the front by `design_id` and channel, of the limit's filter by CFA.
    """

    wavelength_nm: FloatArray
    sensor: dict[str, FloatArray] = field(default_factory=dict)
    lights: dict[tuple[str, str], FloatArray] = field(default_factory=dict)
    drawn: dict[int, FilterCurves] = field(default_factory=dict)
    on_front: dict[int, FilterCurves] = field(default_factory=dict)
    limits: dict[str, FloatArray] = field(default_factory=dict)
    tasks: dict[tuple[str, str], FloatArray] = field(default_factory=dict)

    @property
    def designs(self) -> dict[int, FilterCurves]:
        """All designs that were kept."""
        return {**self.drawn, **self.on_front}

    @property
    def bundles(self) -> dict[str, FloatArray]:
        """Signal type -> photon spectra, ndarray[n_signals, n_wavelengths]."""
        types: dict[str, list[FloatArray]] = {}
        for (kind, _), photons in self.lights.items():
            types.setdefault(kind, []).append(photons)
        return {kind: np.stack(photons) for kind, photons in types.items()}

    def _rows(self) -> Iterator[tuple[str, str, FloatArray, str | None, int | None, str | None]]:
        yield from ((QE, name, values, None, None, None) for name, values in self.sensor.items())
        yield from ((LIGHT, name, values, kind, None, None) for (kind, name), values in self.lights.items())
        yield from ((TASK, name, values, owner, None, None) for (owner, name), values in self.tasks.items())
        for what, designs in ((DESIGN, self.drawn), (ON_FRONT, self.on_front)):
            for design_id, channels in designs.items():
                for channel, values in channels.items():
                    yield what, f"{design_id} {channel}", values, None, design_id, channel
        yield from ((LIMIT, cfa, values, None, None, None) for cfa, values in self.limits.items())

    def table(self) -> pa.Table:
        """The long table, of SCHEMA."""
        rows, size = list(self._rows()), self.wavelength_nm.size
        kinds, names, values, types, ids, channels = zip(*rows, strict=True) if rows else ((),) * 6
        at = np.repeat(np.arange(len(rows)), size)
        columns = {
            "kind": pa.array(kinds, pa.string()).take(at),
            "curve": pa.array(names, pa.string()).take(at),
            "wavelength_nm": pa.array(np.tile(self.wavelength_nm, len(rows))),
            "value": pa.array(np.concatenate([np.empty(0), *values])),
            "signal_type": pa.array(types, pa.string()).take(at),
            "design_id": pa.array(ids, pa.int64()).take(at),
            "channel": pa.array(channels, pa.string()).take(at),
        }
        return pa.table([columns[each.name].cast(each.type) for each in SCHEMA], schema=SCHEMA)

    @classmethod
    def of_table(cls, table: pa.Table) -> KeptCurves:
        """The same from the long table; raises ValueError where curves are not all on one grid."""
        table = table.select(SCHEMA.names).cast(SCHEMA)
        first = np.flatnonzero(np.diff(table["wavelength_nm"].to_numpy()) <= 0)
        size = int(first[0]) + 1 if first.size else len(table)
        if not size or len(table) % size:
            raise ValueError("the curves are not all on one wavelength grid")
        wavelength = table["wavelength_nm"].to_numpy().reshape(-1, size)
        if not (wavelength == wavelength[0]).all():
            raise ValueError("the curves are not all on one wavelength grid")
        values = table["value"].to_numpy().reshape(-1, size)
        found = cls(wavelength[0])
        starts = table.take(pa.array(np.arange(0, len(table), size))).to_pylist()
        for row, curve in zip(starts, values, strict=True):
            found._take(row, curve)
        return found

    def _take(self, row: Mapping[str, object], curve: FloatArray) -> None:
        kind, name = row["kind"], str(row["curve"])
        if kind == QE:
            self.sensor[name] = curve
        elif kind == LIGHT:
            self.lights[str(row["signal_type"]), name] = curve
        elif kind == TASK:
            self.tasks[str(row["signal_type"]), name] = curve
        elif kind == LIMIT:
            self.limits[name] = curve
        else:
            own = self.drawn if kind == DESIGN else self.on_front
            own.setdefault(int(str(row["design_id"])), {})[str(row["channel"])] = curve
