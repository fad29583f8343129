"""Files changed at random: a study or a table is refused in lines, or what it gives is right. Nothing hangs."""

from __future__ import annotations

import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML

from sweep.base.errors import MOST_ISSUES, SweepError
from sweep.study import load_study

from ..conftest import STUDIES
from ..curve_texts import WAVE, bell, csv
from ..mutations import changed, one_of, written
from ..watchdog import within

HANG_S = 120.0
"""For what takes a second or less, on a machine that is busy with other things."""
SHIPPED = sorted(path for path in STUDIES.glob("*.yaml") if path.stem != "measured")
CURVES = "sensor:\n  files:\n    - {file: qe.csv, columns: {R: r, G: g, Y: y, N: g}}\n"
LIGHTS = "lights:\n  files:\n    - {file: led.csv, quantity: energy, outside: zero, signals: {red: [r], yellow: [y]}}\n"


@pytest.fixture
def studies(tmp_path: Path) -> list[dict[str, Any]]:
    """The project's own studies, with few of their scenes, and one with files, as mappings."""
    qe = 0.8 * bell(620, 40), 0.8 * bell(530, 40), 0.4 + 0.5 * bell(600, 60)
    csv(tmp_path, "wavelength_nm,r,g,y", WAVE, *qe, name="qe.csv")
    csv(tmp_path, "wavelength_nm,r,y", WAVE, bell(635, 8), bell(590, 8), name="led.csv")
    texts = [path.read_text() for path in SHIPPED]
    texts.append(f"study: own\n{CURVES}{LIGHTS}cfas: [RGYN, RYGG]\nobjective: csd_red_yellow\n")
    return [YAML(typ="safe", pure=True).load(text) for text in texts]


def told(error: SweepError) -> None:
    """Its lines are what the command prints."""
    lines = str(error).splitlines()
    assert 1 <= len(lines) <= MOST_ISSUES
    assert all(line.strip() and line.isprintable() and len(line) < 20_000 for line in lines)
    str(error).encode()


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 6))])
def test_changed_studies(studies: list[dict[str, Any]], tmp_path: Path, seed: int) -> None:
    rng, path, found = np.random.default_rng([1, seed]), tmp_path / "changed.yaml", Counter[bool]()
    for _ in range(30):
        path.write_bytes(written(changed(rng, one_of(rng, studies))))
        with warnings.catch_warnings(), within(HANG_S):
            warnings.simplefilter("error")
            try:
                load_study(path)
            except SweepError as error:
                told(error)
                found[True] += 1
            else:
                found[False] += 1
    assert min(found[True], found[False]) > 3, found
