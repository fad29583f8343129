"""Readings of made-up cameras, by sums, draws and a converter of their own: nothing of the package is used."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

NM = np.arange(400.0, 721.0)
TILE = (("R", "G"), ("G", "B"))
LEDS_NM = (430, 460, 490, 520, 550, 575, 592, 610, 625, 640, 655, 670)
_ENERGY_J = 6.62607015e-34 * 299792458 / (NM * 1e-9)
FULL_SCALE, WELL_E = 4095, 10_000
PIXELS = 2000


def bell(center_nm: float, width_nm: float) -> np.ndarray:
    return np.exp(-(((NM - center_nm) / width_nm) ** 2) / 2)


def ir_cut(shift_nm: float = 0.0) -> np.ndarray:
    return 0.95 / (1 + np.exp((NM - 655 - shift_nm) / 9))


def qe(moved_nm: float = 0.0, high: float = 0.0) -> dict[str, np.ndarray]:
    """Curves without IR cut; those of R may be wrong: moved, or higher above 620 nm."""
    red = 0.55 / (1 + np.exp(-(NM - 585 - moved_nm) / 8)) + 0.06 * bell(450 + moved_nm, 40)
    return {
        "R": red * np.where(NM > 620, 1 + high, 1.0),
        "G": 0.6 * bell(535, 38) + 0.05,
        "B": 0.55 * bell(462, 32) + 0.03,
    }


def lamps() -> dict[str, np.ndarray]:
    """Energy per nm, as an instrument has it."""
    white = 0.9 * bell(452, 11) + bell(560, 62)
    return {"white": white, **{f"led{center}": bell(center, 9) for center in LEDS_NM}}


@dataclass
class Camera:
    """A camera, as it is."""

    gain: float = 0.4
    black: float = 168.0
    shift: float = 0.0
    crosstalk: float = 0.03
    read_noise: float = 3.0
    moved_nm: float = 0.0
    high: float = 0.0

    def pixels(self) -> dict[str, np.ndarray]:
        """Curves that the pixels of a channel see, also through the filters of their neighbors."""
        own = {name: curve * ir_cut(self.shift) for name, curve in qe(self.moved_nm, self.high).items()}
        seen: dict[str, list[np.ndarray]] = {}
        for row in (0, 1):
            for column in (0, 1):
                beside = [TILE[1 - row][column], TILE[1 - row][column], TILE[row][1 - column], TILE[row][1 - column]]
                mixed = (1 - self.crosstalk) * own[TILE[row][column]]
                for name in beside:
                    mixed = mixed + self.crosstalk / 4 * own[name]
                seen.setdefault(TILE[row][column], []).append(mixed)
        return {name: sum(curves) / len(curves) for name, curves in seen.items()}

    def read(self, rng: np.random.Generator, electrons: float) -> tuple[float, float]:
        """Mean and standard deviation of digital numbers."""
        values = np.minimum(rng.poisson(electrons, PIXELS), WELL_E) + rng.normal(0, self.read_noise, PIXELS)
        dn = np.clip(np.rint(values * self.gain + self.black), 0, FULL_SCALE)
        return float(dn.mean()), float(dn.std(ddof=1))

    def readings(self, rng: np.random.Generator, names: tuple[str, ...] = ()) -> pd.DataFrame:
        """A table: a dark, the white lamp at three exposures, each LED at two."""
        rows = [("dark", name, 0.01, *self.read(rng, 0.0)) for name in "RGB"]
        seen = self.pixels()
        for lamp, energy in lamps().items():
            photons = energy / _ENERGY_J
            rates = {name: float(np.sum(photons / photons.sum() * curve)) for name, curve in seen.items()}
            light = rng.uniform(4000, 8000) / 0.01 / max(rates.values())
            for exposure_s in (0.002, 0.005, 0.01) if lamp == "white" else (0.003, 0.01):
                for name, rate in rates.items():
                    rows.append((lamp, name, exposure_s, *self.read(rng, light * exposure_s * rate)))
        table = pd.DataFrame(rows, columns=["lamp", "channel", "exposure_s", "dn", "sigma_dn"]).assign(pixels=PIXELS)
        return table[table["lamp"].isin(names)] if names else table


STUDY = """\
study: bench
question: Does the model predict the camera?
wavelengths: {start_nm: 400, stop_nm: 720}
sensor: {files: [{file: qe.csv, columns: {R: R, G: G, B: B}}], ir_cut: cut.csv}
lights: {files: [{file: leds.csv, signals: {green: [led520], yellow: [led592], red: [led625, led640]}}]}
cfas: [RGGB]
pixel: {well_e: 10000, gain_dn_per_e: 0.45, offset_dn: 160, crosstalk: 0.02, read_noise_e: 2}
"""


def write_study(folder: Path) -> Path:
    """The study of the nominal camera, with its files; FILE:COLUMN of lamps are relative to the folder."""
    index = pd.Index(NM, name="wavelength_nm")
    pd.DataFrame(qe(), index=index).to_csv(folder / "qe.csv")
    pd.DataFrame({"transmission": ir_cut()}, index=index).to_csv(folder / "cut.csv")
    pd.DataFrame(lamps(), index=index).to_csv(folder / "leds.csv")
    (folder / "bench.yaml").write_text(STUDY)
    return folder / "bench.yaml"


def write_readings(folder: Path, table: pd.DataFrame) -> Path:
    """The table as a file beside the study: lamps of the study by their names, others as columns of a file."""
    of_study = ("led520", "led592", "led625", "led640")
    names = {name: f"leds:{name}" if name in of_study else f"leds.csv:{name}" for name in lamps()}
    table.assign(lamp=[names.get(name, name) for name in table["lamp"]]).to_csv(folder / "readings.csv", index=False)
    return folder / "readings.csv"
