"""Files of curves as users bring them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

WAVE = np.arange(380.0, 781.0, 10)


def bell(center_nm: float, sigma_nm: float) -> np.ndarray:
    return np.exp(-0.5 * ((WAVE - center_nm) / sigma_nm) ** 2)


def csv(folder: Path, header: str, *columns: np.ndarray, name: str = "curves.csv", encoding: str = "utf-8") -> Path:
    path = folder / name
    rows = [",".join(f"{number:.6g}" for number in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([header, *rows]) + "\n", encoding=encoding)
    return path
