"""Files changed at random: a study or a table is refused in lines, or what it gives is right. Nothing hangs."""

from __future__ import annotations

import warnings
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML

from sweep.base.errors import MOST_ISSUES, SweepError
from sweep.run.rows import Job, Rows, rows_of, rules_of
from sweep.study import Study, load_study

from ..conftest import STUDIES
from ..mutations import changed, one_of, torn, written
from ..watchdog import within

HANG_S = 120.0
"""For what takes a second or less, on a machine that is busy with other things."""
SHIPPED = sorted(path for path in STUDIES.glob("*.yaml") if path.stem != "measured")
CURVES = "sensor:\n  files:\n    - {file: qe.csv, columns: {R: r, G: g, Y: y, N: g}}\n"
LIGHTS = "lights:\n  files:\n    - {file: led.csv, quantity: energy, outside: zero, signals: {red: [r], yellow: [y]}}\n"
WAVE = np.arange(390, 711, 10.0)


def bell(center_nm: float, width_nm: float) -> np.ndarray:
    return np.exp(-(((WAVE - center_nm) / width_nm) ** 2))


def table(**columns: np.ndarray) -> bytes:
    rows = [["wavelength_nm", *columns], *np.stack([WAVE, *columns.values()], axis=1).tolist()]
    return "".join(",".join(map(str, row)) + "\n" for row in rows).encode()


QE = table(r=0.8 * bell(620, 60), g=0.8 * bell(530, 60), y=0.4 + 0.5 * bell(600, 90))
LEDS = table(r=bell(635, 12), y=bell(590, 12))


@pytest.fixture
def studies(tmp_path: Path) -> list[dict[str, Any]]:
    """The project's own studies, with few of their scenes, and one with files, as mappings."""
    (tmp_path / "qe.csv").write_bytes(QE)
    (tmp_path / "led.csv").write_bytes(LEDS)
    texts = [path.read_text() for path in SHIPPED]
    texts.append(f"study: own\n{CURVES}{LIGHTS}cfas: [RGYN, RYGG]\nobjective: csd_red_yellow\n")
    return [YAML(typ="safe", pure=True).load(text) for text in texts]


def told(error: SweepError) -> None:
    """Its lines are what the command prints."""
    lines = str(error).splitlines()
    assert 1 <= len(lines) <= MOST_ISSUES
    assert all(line.strip() and line.isprintable() and len(line) < 20_000 for line in lines)
    str(error).encode()


def first_rows(study: Study, scenario: str) -> set[str]:
    """The statuses of the first designs of each space, planned and computed with all columns."""
    planned = replace(study, plans={scenario: study.plan(scenario)}, scenarios={scenario: study.scenarios[scenario]})
    rules, found = rules_of(planned), set()
    for number, space in enumerate(planned.spaces):
        if not space.size:
            continue
        first = Rows.of(Job(number, scenario, 0, min(space.size, 2), 0, 0), planned)
        made = rows_of(first, planned.setup(space, scenario), rules, rules.wanted)
        found |= set(made["status"].to_pylist())
    return found


def light(study: Study) -> str | None:
    """A scene that is planned and computed in a second, if there is one: a patch, or a light at a given place."""
    quick = study.grid.size <= 401 and all(len(m.channels) < 8 for m in study.mosaics.values())
    fewer = len(study.spaces) <= 20 and study.section.recognition is None and study.section.vision is None
    names = [n for n, s in study.scenarios.items() if s.target is None or s.target.phase_px != "any"]
    return names[0] if names and quick and fewer else None


def tried(path: Path, *, compute: bool) -> str:
    """What comes of a study: refused, loaded or computed; anything else is an error of the test."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            with within(HANG_S):
                study = load_study(path)
        except SweepError as error:
            told(error)
            return "refused"
        scenario = light(study) if compute else None
        if scenario is None:
            return "loaded"
        try:
            with within(HANG_S):
                statuses = first_rows(study, scenario)
        except SweepError as error:
            told(error)
            return "refused when planned"
    assert not [status for status in statuses if status.startswith("error")], (statuses, path.read_text())
    return "computed"


@pytest.mark.parametrize(
    ("seed", "count"), [(0, 15), (1, 15), *(pytest.param(seed, 100, marks=pytest.mark.slow) for seed in range(2, 7))]
)
def test_changed_studies(studies: list[dict[str, Any]], tmp_path: Path, seed: int, count: int) -> None:
    rng, path, found = np.random.default_rng([1, seed]), tmp_path / "changed.yaml", Counter()
    for index in range(count):
        tree = one_of(rng, studies)
        path.write_bytes(written(changed(rng, tree)) if index % 3 else torn(rng, written(tree), 2))
        found[tried(path, compute=count > 15)] += 1
    assert found["refused"] > count // 5, found
    assert count == 15 or found["computed"] > 5, found
