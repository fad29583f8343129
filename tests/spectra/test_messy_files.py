"""Files as instruments, spreadsheets and colleagues write them: read where they can be meant in one way, and told."""

from __future__ import annotations

import gzip
import io
import zipfile
from collections.abc import Callable
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

from sweep.base.errors import SweepError
from sweep.spectra import read_text
from sweep.spectra.formats import read_curves, scan_curves
from sweep.spectra.lens_files import read_chief_rays
from sweep.study import load_study

from ..build import one_line
from ..cases import thinned
from ..commanded import commanded
from ..curve_texts import WAVE, bell

QE = np.round(np.stack([bell(610, 45), bell(535, 42), bell(460, 35)], axis=1) * 0.6, 5)
NAMES = ("R", "G", "B")


def text(
    mark: str = ",",
    head: str = "wavelength_nm",
    rows: slice = slice(None),
    wave: np.ndarray = WAVE,
    values: np.ndarray = QE,
    cell: Callable[[float], str] = "{:g}".format,
    decimal: str = ".",
    tail: str = "",
    before: str = "",
) -> str:
    lines = [mark.join([head, *NAMES]) + tail]
    for nm, row in list(zip(wave, values, strict=True))[rows]:
        lines.append(mark.join([f"{nm:g}".replace(".", decimal), *(cell(v).replace(".", decimal) for v in row)]) + tail)
    return before + "\n".join(lines) + "\n"


_NUMBERS = text("\t").split("\n", 1)[1]
_COLUMNS = [*zip(*[line.split(",") for line in text().splitlines()], strict=True)]

VARIANTS: dict[str, tuple[str, str, str]] = {
    "decimal comma": ("a.csv", text(";", decimal=","), "decimal commas"),
    "lambda": ("a.csv", text(head="lambda"), "taken for nm by their size"),
    "micrometers": ("a.csv", text(head="wavelength_um", wave=WAVE / 1000), "in um were brought to nm"),
    "falling": ("a.csv", text(rows=slice(None, None, -1)), "turned round"),
    "title lines": ("a.csv", text(before="QE of sensor X\nmeasured 2024, room 3\n"), "2 title lines were left out"),
    "a row of units": (
        "a.csv",
        text(head="Wavelength", values=100 * QE).replace("\n", "\nnm,%,%,%\n", 1),
        "a row of units was read",
    ),
    "percent signs": ("a.csv", text(cell=lambda v: f"{100 * v:g} %"), "percent signs"),
    "wavelengths last": (
        "a.csv",
        "\n".join(",".join(r) for r in zip(*_COLUMNS[1:], _COLUMNS[0], strict=True)),
        "column 'wavelength_nm'",
    ),
    "rows counted": (
        "a.csv",
        "\n".join(f"{'' if i == 0 else i - 1},{x}" for i, x in enumerate(text().splitlines())),
        "counts the rows",
    ),
    "Thorlabs spectrometer": (
        "a.txt",
        "[SpectrumHeader]\nDate;2024\n[Data]\n" + _NUMBERS.replace("\t", ";") + "[EndOfFile]\n",
        "there is no header",
    ),
    "numbers alone": ("a.txt", _NUMBERS, "there is no header"),
    "small negatives": (
        "a.csv",
        text(values=np.where(QE < 1e-3, -0.002, QE)),
        "negatives of noise, down to -0.002, were set to 0",
    ),
    "one sample missing": (
        "a.csv",
        text().replace(f"600,{QE[22, 0]:g}", "600,", 1),
        "R: the missing value at 600 nm is",
    ),
    "a row twice": (
        "a.csv",
        text().replace("\n600,", f"\n590,{','.join(f'{v:g}' for v in QE[21])}\n600,", 1),
        "averaged, at 1 wavelength",
    ),
}
"""Name of the file, its text, and a word of the line that says how it was read."""


@pytest.mark.usefixtures("plain_pictures")
@pytest.mark.parametrize("name", thinned(VARIANTS, 3))
def test_a_file_variant_is_read_or_refused_with_advice(tmp_path: Path, name: str) -> None:
    file, content, said = VARIANTS[name]
    path = tmp_path / file
    path.write_text(content)
    code, out, err = commanded("describe", path, "--output", tmp_path / "drawn")
    assert (code, err) == (0, "")
    assert any(line.startswith("Read: ") and said in line for line in out.splitlines())
    found = read_curves(path)
    np.testing.assert_allclose(found.wavelength_nm, WAVE, rtol=0, atol=1e-9)
    right = 100 * QE if name == "a row of units" else QE
    rounded = name in ("small negatives", "one sample missing")
    values = np.stack([*found.values.values()], axis=1)
    np.testing.assert_allclose(values, right, rtol=1e-5, atol=0.03 if rounded else 1e-12)
    code, _, err = commanded("new", "mine", "--qe", path, "--folder", tmp_path / "studies")
    if name in ("Thorlabs spectrometer", "numbers alone"):  # their curves have no names
        assert code == 2
        assert "no column names a channel (got 'curve_1, curve_2, curve_3')" in err
        return
    study = load_study(tmp_path / "studies" / "mine.yaml")
    assert all(said in "".join(study.warnings) for said in found.notes)
    if name == "a row of units":
        assert study.section.sensor.files[0].scale == 0.01


def zipped() -> bytes:
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w") as archive:
        archive.writestr("curves", np.random.default_rng(1).bytes(20_000_000))
    return held.getvalue()


NO_TEXTS: dict[str, Callable[[], bytes]] = {
    "zip": zipped,
    "xls": lambda: b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600),
    "gzip": lambda: gzip.compress(text().encode()),
    "program": lambda: b"\x7fELF\x02\x01\x01" + bytes(50),
    "random": lambda: b"x" + np.random.default_rng(1).bytes(5000),
}


@pytest.mark.parametrize("kind", NO_TEXTS)
def test_binary_files_are_refused_before_parsing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    path, study = tmp_path / "a.csv", tmp_path / "x.yaml"
    path.write_bytes(NO_TEXTS[kind]())
    sections = [
        "sensor: {files: [{file: a.csv, columns: {R: R, C: C}}]}",
        "lights: {files: [{file: a.csv, quantity: energy, signals: {red: [r], green: [g]}}]}",
    ]
    study.write_text("\n".join(["study: x", *sections, "cfas: [RCCC]", ""]))
    monkeypatch.setattr(read_text, "_cells", mock.Mock(side_effect=AssertionError))
    line = "not a text table; allowed: text; save a spreadsheet as CSV"
    assert commanded("describe", path) == (2, "", f"sweep: {path}: {line}\n")
    assert line in commanded("check", study)[2]
    study.write_text("\n".join(["study: x", "sensor: ar0820", *sections[1:], "cfas: [RGGB]", ""]))
    assert line in commanded("check", study)[2]
    with one_line("not a text table"):
        read_chief_rays(path)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_xml_with_entities_is_refused_in_every_encoding(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "a.spdx"
    path.write_text(f"<?xml version='1.0' encoding='{encoding}'?><!DOCTYPE x [<!ENTITY a 'b'>]><x>&a;</x>", encoding)
    with one_line("without"):
        scan_curves(path)


def mutated(rng: np.random.Generator) -> str:
    """The table with a layout of its own, and in half of the cases with a damage that leaves the digits as they are."""
    mark = str(rng.choice([",", ";", "\t", "  "]))
    decimal = "," if mark in (";", "\t") and rng.integers(2) else "."
    head = str(
        rng.choice(["wavelength_nm", "nm", "Wavelength (nm)", "lambda", "Wavelength [um]", "wavelengthnm", "WL"])
    )
    wave = WAVE / 1000 if "um" in head else WAVE
    before = str(rng.choice(["", "", "a title\n", "# note\n\n", "QE, measured; 2024\n"]))
    lines = text(
        mark, head, slice(None, None, int(rng.choice([1, -1]))), wave, decimal=decimal, before=before
    ).splitlines()
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
