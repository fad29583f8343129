"""Files of Gaussian lights."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd


def lights(folder: Path, name: str, yellow_nm: float, red_nm: float) -> None:
    """A file of Gaussian lights; r2 is much wider than the others."""
    wave = np.arange(400.0, 701.0)

    def bump(center: float, width: float) -> np.ndarray:
        return np.asarray(np.exp(-0.5 * ((wave - center) / width) ** 2))

    columns = {"g1": bump(505, 15), "y1": bump(yellow_nm, 8), "r1": bump(red_nm, 9), "r2": bump(red_nm + 8, 25)}
    pd.DataFrame({"wavelength_nm": wave, **columns}).to_csv(folder / f"{name}.csv", index=False)
