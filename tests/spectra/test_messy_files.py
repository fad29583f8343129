"""Files as instruments, spreadsheets and colleagues write them: read where they can be meant in one way, and told."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

from sweep.base.errors import SweepError
from sweep.spectra import read_text
from sweep.spectra.formats import read_curves
from sweep.spectra.lens_files import read_chief_rays
from sweep.study import load_study

from ..build import one_line
from ..commanded import commanded
from ..curve_texts import WAVE, bell

QE = np.round(np.stack([bell(610, 45), bell(535, 42), bell(460, 35)], axis=1) * 0.6, 5)
NAMES = ("R", "G", "B")


def text(
    mark: str = ",",
    head: str = "wavelength_nm",
    values: np.ndarray = QE,
    cell: Callable[[float], str] = "{:g}".format,
    decimal: str = ".",
    before: str = "",
) -> str:
    lines = [mark.join([head, *NAMES])]
    for nm, row in zip(WAVE, values, strict=True):
        lines.append(mark.join([f"{nm:g}", *(cell(v).replace(".", decimal) for v in row)]))
    return before + "\n".join(lines) + "\n"


_COLUMNS = [*zip(*[line.split(",") for line in text().splitlines()], strict=True)]

VARIANTS: dict[str, tuple[str, str, str]] = {
    "percent signs": ("a.csv", text(cell=lambda v: f"{100 * v:g} %"), "percent signs"),
    "wavelengths last": (
        "a.csv",
        "\n".join(",".join(r) for r in zip(*_COLUMNS[1:], _COLUMNS[0], strict=True)),
        "column 'wavelength_nm'",
    ),
    "Thorlabs spectrometer": (
        "a.txt",
        "[SpectrumHeader]\nDate;2024\n[Data]\n" + text(";").split("\n", 1)[1] + "[EndOfFile]\n",
        "there is no header",
    ),
    "small negatives": (
        "a.csv",
        text(values=np.where(QE < 1e-3, -0.002, QE)),
        "negatives of noise",
    ),
    "one sample missing": (
        "a.csv",
        text().replace(f"600,{QE[22, 0]:g}", "600,", 1),
        "missing value at 600 nm",
    ),
    "a row twice": (
        "a.csv",
        text().replace("\n600,", f"\n590,{','.join(f'{v:g}' for v in QE[21])}\n600,", 1),
        "averaged, at 1 wavelength",
    ),
}
"""Name of the file, its text, and a word of the line that says how it was read."""


@pytest.mark.parametrize("name", VARIANTS)
def test_a_file_variant_is_read_and_says_how(tmp_path: Path, name: str) -> None:
    file, content, said = VARIANTS[name]
    path = tmp_path / file
    path.write_text(content)
    found = read_curves(path)
    assert any(said in note for note in found.notes)
    np.testing.assert_allclose(found.wavelength_nm, WAVE, rtol=0, atol=1e-9)
    rounded = name in ("small negatives", "one sample missing")
    values = np.stack([*found.values.values()], axis=1)
    np.testing.assert_allclose(values, QE, rtol=1e-5, atol=0.03 if rounded else 1e-12)


@pytest.mark.feature("describe")
@pytest.mark.usefixtures("plain_pictures")
def test_how_a_file_was_read_is_said_where_it_is_used(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text(head="Wavelength", values=100 * QE).replace("\n", "\nnm,%,%,%\n", 1))
    notes = read_curves(path).notes
    code, out, _ = commanded("describe", path, "--output", tmp_path / "drawn")
    assert (code, all(f"Read: {note}" in out for note in notes)) == (0, True)
    assert commanded("new", "mine", "--qe", path, "--folder", tmp_path)[0] == 0
    study = load_study(tmp_path / "mine.yaml")
    assert all(note in "".join(study.warnings) for note in notes)
    assert study.section.sensor.files[0].scale == 0.01


NO_TEXTS: dict[str, Callable[[], bytes]] = {
    "zip": lambda: b"PK\x03\x04" + np.random.default_rng(1).bytes(20_000_000),
    "gzip": lambda: gzip.compress(text().encode()),
    "random": lambda: b"x" + np.random.default_rng(1).bytes(5000),
}


@pytest.mark.parametrize("kind", NO_TEXTS)
def test_binary_files_are_refused_before_parsing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    path, study = tmp_path / "a.csv", tmp_path / "x.yaml"
    path.write_bytes(NO_TEXTS[kind]())
    study.write_text("study: x\nsensor: {files: [{file: a.csv, columns: {R: R, C: C}}]}\nlights: tl16\ncfas: [RCCC]\n")
    monkeypatch.setattr(read_text, "_cells", mock.Mock(side_effect=AssertionError))
    assert "not a text table" in commanded("check", study)[2]
    for read in (read_curves, read_chief_rays):
        with one_line("not a text table"):
            read(path)


def mutated(rng: np.random.Generator) -> str:
    """The table with a layout of its own, and in half of the cases with a damage that leaves the digits as they are."""
    mark = str(rng.choice([",", ";", "\t", "  "]))
    decimal = "," if mark in (";", "\t") and rng.integers(2) else "."
    before = str(rng.choice(["", "", "a title\n", "QE, measured; 2024\n"]))
    lines = text(mark, "lambda", decimal=decimal, before=before).splitlines()
    if rng.integers(2):
        at = int(rng.integers(len(lines)))
        place = int(rng.integers(max(1, len(lines[at]))))
        match int(rng.integers(7)):
            case 0:
                lines[at] = lines[at][:place] + mark + lines[at][place:]
            case 1:
                lines[at] = lines[at].replace(mark, "", 1)
            case 2:
                lines[at] = (
                    lines[at][:place]
                    + str(rng.choice(["x", '"', "NaN", "-", "\t", ";", "%", "\u00e9"]))
                    + lines[at][place:]
                )
            case 3:
                lines = lines[:at]
            case 4:
                lines.insert(at, lines[int(rng.integers(len(lines)))])
            case 5:
                lines.pop(at)
            case _:
                lines[at] = lines[at] + mark
    return "\n".join(lines)


def test_of_mutated_files_none_is_a_wrong_curve(tmp_path: Path) -> None:
    """Every curve that is read from one of 400 files has the values of the clean one, wherever it has samples."""
    rng, taken, path = np.random.default_rng(7), 0, tmp_path / "a.csv"
    for _ in range(400):
        path.write_text(mutated(rng), encoding="latin-1")
        try:
            found = read_curves(path)
        except SweepError:
            continue
        taken += 1
        at = [int(np.argmin(abs(WAVE - nm))) for nm in found.wavelength_nm]
        np.testing.assert_allclose(WAVE[at], found.wavelength_nm, atol=1e-9, err_msg=path.read_text(encoding="latin-1"))
        np.testing.assert_allclose(
            np.stack([*found.values.values()], axis=1), QE[at], atol=1e-9, err_msg=path.read_text(encoding="latin-1")
        )
    assert taken > 150
