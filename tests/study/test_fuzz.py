"""Files changed at random: a study or a table is refused in lines, or what it gives is right. Nothing hangs."""

from __future__ import annotations

import csv
import warnings
from collections import Counter
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML
from scipy.io import loadmat, savemat

from sweep.base.errors import MOST_ISSUES, SweepError
from sweep.cli.describe import described
from sweep.run.rows import Job, Rows, rows_of, rules_of
from sweep.spectra.formats import read_curves
from sweep.study import Study, load_study

from ..commanded import commanded
from ..conftest import STUDIES
from ..mutations import EXTREMES, changed, one_of, torn, written
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


@pytest.mark.slow
def test_changed_studies_through_the_command(studies: list[dict[str, Any]], tmp_path: Path) -> None:
    rng, path = np.random.default_rng(3), tmp_path / "changed.yaml"
    for index in range(20):
        tree = one_of(rng, studies)
        path.write_bytes(written(changed(rng, tree)) if index % 2 else torn(rng, written(tree)))
        with within(HANG_S):
            code, _, said = commanded("check", path)
        assert code in (0, 2), said
        assert "Traceback" not in said
        assert "Warning" not in said
        assert code == 0 or all(line.startswith("sweep: ") for line in said.splitlines())


def cells(rng: np.random.Generator, content: bytes) -> bytes:
    """A table with some cells, rows, columns, its header or its encoding changed."""
    rows = [line.split(",") for line in content.decode().splitlines()]
    for _ in range(int(rng.integers(0, 3))):
        row = one_of(rng, rows)
        column = int(rng.integers(len(row)))
        match int(rng.integers(7)):
            case 0 | 1:
                row[column] = str(one_of(rng, [v for v in EXTREMES if isinstance(v, int | float | str)]))
            case 2:
                row.insert(column, one_of(rng, ["1", "", "#", "1,5", '"', "NaN"]))
            case 3:
                rows.insert(int(rng.integers(len(rows))), list(row))
            case 4:
                for other in rows:
                    other.append(other[min(column, len(other) - 1)])
            case 5 if len(rows) > 2:
                rows.remove(row)
            case _:
                row[column] = f" {row[column]}\t"
    text = one_of(rng, ["\n", "\n", "\r\n", "\r"]).join(one_of(rng, [*[","] * 8, ";", "\t"]).join(row) for row in rows)
    return text.encode(one_of(rng, [*["utf-8"] * 12, "utf-8-sig", "utf-16", "utf-16-le", "utf-32"]))


def by_hand(content: bytes) -> tuple[list[str], np.ndarray]:
    """Names and numbers of a table as Python's csv and float read them."""
    text = content.decode("utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    head = next(line for line in text.splitlines() if line.strip() and not line.startswith("#"))
    mark = next(mark for mark in "\t;," if mark in head)
    lines = [line for line in text[text.index(head) :].splitlines() if line.strip() and not line.startswith("#")]
    rows = [row for row in csv.reader(lines, delimiter=mark) if any(map(str.strip, row))]
    if {row[-1].strip() for row in rows[1:]} == {""}:  # a last column that is empty
        rows = [row[:-1] if len(row) == len(rows[1]) else row for row in rows]
    if "wavelength_nm" not in rows[0][0]:  # the head is lost
        rows = [["wavelength_nm", *(f"curve_{at}" for at in range(1, len(rows[0])))], *rows]
    rows = [rows[0], *(row for row in rows[1:] if "wavelength_nm" not in row[0])]  # a head that stands twice
    numbers = np.array([[float(cell.replace(",", ".").strip() or "nan") for cell in row] for row in rows[1:]])
    return [name.strip() for name in rows[0]], numbers


def curves_tried(path: Path, content: bytes, folder: Path | None) -> bool:
    """Whether a file was taken; its numbers are then what another reader finds. `folder`: describe it, too."""
    path.write_bytes(content)
    try:
        with warnings.catch_warnings(), within(HANG_S):
            warnings.simplefilter("error")
            if folder is not None:
                described(path, folder)
            found = read_curves(path)
    except SweepError as error:
        told(error)
        return False
    if path.suffix == ".csv":
        names, numbers = by_hand(content)
        assert [*found.values] == names[1:]
    else:
        fields = loadmat(BytesIO(content), variable_names=("wavelength", "data"))
        data = np.asarray(fields["data"], dtype=float)
        wave = np.asarray(fields["wavelength"], dtype=float).reshape(-1, 1)
        numbers = np.hstack([wave, data if len(data) == len(wave) else data.T])
    once = [row for row in numbers if np.count_nonzero(numbers[:, 0] == row[0]) == 1]
    for row in once:  # what stands twice is averaged, what is missing filled, and noise below 0 is 0
        (at,) = np.flatnonzero(found.wavelength_nm == row[0])
        for name, value in zip(found.values, row[1:], strict=True):
            own = found.values[name][at]
            assert own == value or np.isnan(value) or (value < 0 and own == 0), (name, row[0], own, value)
    assert len(once) > 5
    return True


def mat_file(rng: np.random.Generator) -> bytes:
    content = BytesIO()
    names = np.array([["r", "y"]], dtype=object)
    data = np.stack([bell(635, 12), bell(590, 12)], axis=1)
    wave = WAVE[:, None] if rng.integers(2) else WAVE[None]
    fields = {"wavelength": wave, "data": data, "filterNames": names, "comment": "x" * int(rng.integers(9))}
    savemat(content, fields, do_compression=bool(rng.integers(2)))
    return content.getvalue()


def damaged(rng: np.random.Generator, content: bytes) -> bytes:
    """A binary file with some bits flipped, or words of its head replaced, or cut off."""
    damage = bytearray(content)
    for _ in range(int(rng.integers(0, 3))):
        match int(rng.integers(4)):
            case 0:
                place = int(rng.integers(120, len(damage)))
                damage[place] ^= 1 << int(rng.integers(8))
            case 1:
                place = 4 * int(rng.integers(30, min(200, len(damage) // 4 - 1)))
                damage[place : place + 4] = one_of(rng, [b"\xff" * 4, bytes(4), b"\xff\xff\xff\x7f", b"\x0e\0\0\0"])
            case 2:
                damage[int(rng.integers(128, len(damage))) :] = b""
                damage += bytes(200 - len(damage)) if len(damage) < 200 else b""
            case _:
                place = int(rng.integers(128, len(damage)))
                damage[place:place] = rng.bytes(int(rng.integers(1, 9)))
    return bytes(damage)


def changed_table(rng: np.random.Generator, index: int) -> tuple[str, bytes]:
    if index % 3 == 0:
        return "a.mat", damaged(rng, mat_file(rng))
    source = one_of(rng, [QE, LEDS])
    return "a.csv", cells(rng, source) if index % 3 == 1 else torn(rng, source, 1)


@pytest.mark.parametrize(
    ("seed", "count"), [(0, 40), (1, 40), *(pytest.param(seed, 100, marks=pytest.mark.slow) for seed in range(2, 5))]
)
def test_changed_tables_are_read_and_described(tmp_path: Path, seed: int, count: int) -> None:
    rng, found = np.random.default_rng([4, seed]), Counter()
    for index in range(count):
        name, content = changed_table(rng, index)
        pictures = tmp_path / f"pictures-{index}" if count > 40 and index % 3 == 0 else None
        found[curves_tried(tmp_path / name, content, pictures)] += 1
    assert min(found[True], found[False]) > 3, found
