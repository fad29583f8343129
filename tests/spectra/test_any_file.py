"""Files as laboratories, data sheets and spreadsheets have them: the right curve, or one line that says why not."""

from __future__ import annotations

import itertools
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from sweep.base.errors import DataError
from sweep.features.tasks.task_sets import illuminant
from sweep.spectra.builtin.registry import BUILT_IN_LIGHTS
from sweep.spectra.formats import read_curves
from sweep.spectra.spectrum import Quantity, WavelengthGrid
from sweep.spectra.units import Use, unit_of, used_as
from sweep.study import load_study

from ..build import load, one_line
from ..cases import thinned
from ..commanded import commanded
from ..late import Late
from ..watchdog import within

openpyxl = Late("openpyxl")

E_C, H, C = 1.602176634e-19, 6.62607015e-34, 299792458.0
PEAKS = {"sensor": (610, 540, 460, 570), "filter": (560, 640, 500, 590), "light": (505, 592, 628, 636)}
NAMES = {
    "sensor": (("R", "G", "B", "C"), ("red", "green", "blue", "clear"), ("QE Rot", "QE Grün", "QE Blau", "QE Klar")),
    "filter": (("notch", "Sample1", "Filter B", "F4"),),
    "light": (("led 1", "amber", "TL_red", "red2"), ("505", "592", "628", "636")),
}
UNITS: dict[Use, tuple[str, ...]] = {
    "sensor": ("", "QE", "%", "A/W", "mA/W"),
    "filter": ("", "T", "%T", "OD", "Absorbance", "dB"),
    "light": ("", "W/m2/nm", "µW/cm²/nm", "photons/s/nm"),
}
"""Words of the head, in brackets."""


def in_unit(unit: str, right: np.ndarray, nm: np.ndarray) -> np.ndarray:
    """The numbers in the file of right values."""
    match unit:
        case "%" | "%T":
            return 100 * right
        case "A/W" | "mA/W":
            return (1e3 if unit == "mA/W" else 1.0) * right * nm * 1e-9 * E_C / (H * C)
        case "OD" | "Absorbance":
            return -np.log10(right)
        case "dB":
            return 10 * np.log10(right)
    return right


@dataclass(frozen=True)
class Written:
    """A file, the right values of its curves and what they are."""

    text: str
    use: Use
    wave_nm: np.ndarray
    values: np.ndarray
    unit: str


def table(rng: np.random.Generator) -> Written:
    """A table in a layout of its own, from a writer that knows nothing of the reader."""
    use: Use = ("sensor", "filter", "light")[rng.integers(3)]
    step = int(rng.choice([1, 2, 5, 10]))
    nm = np.arange(int(rng.choice([350, 380, 400])), 781, step).astype(float)
    count = int(rng.integers(1, 5))
    width = 14.0 if use == "light" else 45.0
    right = np.stack([0.004 + 0.6 * np.exp(-(((nm - peak) / width) ** 2)) for peak in PEAKS[use][:count]], axis=1)
    unit = str(rng.choice([*UNITS[use]]))
    numbers = in_unit(unit, right, nm[:, None])
    mark = str(rng.choice([",", ";", "\t", "|"]))
    decimal = "," if rng.integers(2) and mark != "," else "."
    of_wave, scale = [("nm", 1.0), ("nm", 1.0), ("um", 1e-3)][rng.integers(3)]

    def cell(number: float) -> str:
        text = f"{number:.9g}" if rng.integers(4) else f"{number:.9e}"
        return text.replace(".", decimal)

    names = list(NAMES[use][rng.integers(len(NAMES[use]))][:count])
    heads = [f"{name} [{unit}]" if unit else name for name in names]
    layout = str(rng.choice(["down", "down", "along", "pairs"]))
    order = np.arange(nm.size)
    if layout != "along":
        order = (order, order[::-1], rng.permutation(nm.size))[rng.integers(3)]
    waves = [cell(value * scale) for value in nm[order]]
    columns = [[cell(value) for value in numbers[order, at]] for at in range(count)]
    lines: list[list[str]] = []
    word = str(rng.choice(["Wavelength", "wavelength", "Wellenlänge", "lambda", "WL"]))
    first = of_wave if layout == "along" or rng.integers(3) == 0 else f"{word} ({of_wave})"
    if layout == "along":
        first, after = ("lamp", "name", "", of_wave)[rng.integers(4)], ("", " nm", "[nm]")[rng.integers(3)]
        waves = [f"{value:g}{after}" for value in nm]
        lines = [[first, *waves], *([head, *column] for head, column in zip(heads, columns, strict=True))]
    elif layout == "pairs":
        if rng.integers(2):
            lines.append(list(itertools.chain(*([name, ""] for name in heads))))
            lines.append([of_wave if rng.integers(2) else "X", "Y"] * count)
        else:
            lines.append(list(itertools.chain(*([f"{word} ({of_wave})", head] for head in heads))))
        lines += [
            list(itertools.chain(*([w, v] for v in row)))
            for w, row in zip(waves, zip(*columns, strict=True), strict=True)
        ]
    else:
        lines = [[first, *heads], *([w, *row] for w, row in zip(waves, zip(*columns, strict=True), strict=True))]
        if rng.integers(6) == 0:
            lines = [["" if at == 0 else str(at - 1), *line] for at, line in enumerate(lines)]
    text = [mark.join(line) for line in lines]
    if rng.integers(5) == 0:
        text = [line + mark for line in text]
    before = [["# note"], ["report of lamp 7"], [""], []][rng.integers(4)]
    joined = ("\r\n", "\n")[rng.integers(2)].join([*before, *text, ""])
    return Written(joined, use, nm, right, unit)


def reads_back(path: Path, written: Written) -> bool:
    """Whether a file was read, and then rightly; raises AssertionError for any other number."""
    try:
        curves = read_curves(path)
        made = used_as(curves, list(curves.values), written.use)
    except DataError:
        return False
    found = np.stack([np.interp(written.wave_nm, *made.samples(name)) for name in made.values], axis=1)
    assert found.shape == written.values.shape, written.text[:600]
    off = np.abs(found - written.values).max()
    assert off <= 1e-6 * np.abs(written.values).max(), (made.notes, written.unit, written.text[:600])
    if written.use == "light":
        quantity = "photons" if written.unit.startswith("photon") else "energy"
        assert {made.units[name].quantity for name in made.values} == {quantity}
    return True


@pytest.mark.parametrize("seed", thinned(range(4), 4))
def test_of_a_thousand_layouts_none_is_another_number(tmp_path: Path, seed: int) -> None:
    rng, read = np.random.default_rng([12, seed]), 0
    for number in range(250):
        written = table(rng)
        path = tmp_path / f"a.{('csv', 'txt', 'dat')[number % 3]}"
        encoding = str(rng.choice(["utf-8", "utf-8-sig", "utf-16", "latin-1", "utf-16-le"]))
        path.write_bytes(written.text.encode(encoding, "replace"))
        read += reads_back(path, written)
    assert read > 212


MEANINGS = """
R | | |
Red (A/W) | responsivity | 1 |
Blau [mA/W] | responsivity | 0.001 |
R (A·W⁻¹) | responsivity | 1 |
R / A W^-1 | responsivity | 1 |
responsivity | responsivity | |
Spectral Responsivity (A/W) | responsivity | 1 |
relative responsivity | relative_responsivity | |
Responsivity, normalized | responsivity | |
SSF per energy | relative_responsivity | |
Relative Response | ? | |
spectral sensitivity | ? | |
Empfindlichkeit | ? | |
QE | qe | |
QE Rot [%] | qe | 0.01 |
QE_G | qe | |
green qe % | qe | 0.01 |
EQE (%) | qe | 0.01 |
IPCE / % | qe | 0.01 |
quantum efficiency | qe | |
Quantum Efficiency [%] | qe | 0.01 |
Quanteneffizienz (%) | qe | 0.01 |
Quantenausbeute | qe | |
rendement quantique [%] | qe | 0.01 |
Rendement Quantique | qe | |
B [e-/photon] | qe | 1 |
B (e/ph) | qe | 1 |
QE (A/W) | ? | |
QE [fraction] | qe | 1 |
QE (0-1) | qe | 1 |
R (%) | | 0.01 |
R [percent] | | 0.01 |
Rot (Prozent) | | 0.01 |
R_pct | | 0.01 |
C (-) | | 1 |
C [1] | | 1 |
R (a.u.) | | 1 |
R (arb. units) | | 1 |
Red (norm.) | | 1 |
R (V/lx/s) | ? | |
R [V] | ? | |
R (left) | | |
T | transmission | |
t | transmission | |
%T | transmission | 0.01 |
T% | transmission | 0.01 |
T (%) | transmission | 0.01 |
T [%] | transmission | 0.01 |
Baseline 100%T | transmission | 0.01 |
Sample 3 %T | transmission | 0.01 |
Transmission | transmission | |
transmittance | transmission | |
Transmittance (%) | transmission | 0.01 |
internal transmittance | ? | |
Transmissionsgrad [%] | transmission | 0.01 |
Durchlässigkeit [%] | transmission | 0.01 |
facteur de transmission | transmission | |
IR cut transmission % | transmission | 0.01 |
Transmission (dB) | decibel | 1 |
Loss [dB] | decibel | 1 |
S21 (dB) | decibel | 1 |
OD | density | |
OD 4 notch | | |
633 OD | density | 1 |
notch (OD) | density | 1 |
Optical Density | density | |
optische Dichte | density | |
densité optique | density | |
Absorbance | density | |
Absorbance (%) | ? | |
Absorbance (base e) | ? | |
Absorbance (mAU) | ? | |
1-T | ? | |
Abs | density | |
Extinktion | density | |
Absorption | ? | |
absorptance | ? | |
Extinction | ? | |
OD (%) | ? | |
Reflectance | reflectance | |
%R | reflectance | 0.01 |
Remission [%] | reflectance | 0.01 |
Reflexionsgrad | reflectance | |
T1 | | |
TL red | | |
Y592 | | |
505 | | |
led_red | | |
W | | |
power [W] | energy | 1 |
Radiance [W/(sr m2 nm)] | energy | 1 |
Spectral Irradiance (W/m²/nm) | energy | 1 |
Irradiance [µW/cm²/nm] | energy | 1 |
mW/nm | energy | 1 |
W/m2/nm | energy | 1 |
SPD | energy | |
Strahldichte | energy | |
Bestrahlungsstärke [W/m2/nm] | energy | 1 |
amber (W m-2 nm-1) | energy | 1 |
spectral power | | |
Lamp (W/m2/Hz) | ? | |
Lamp (photons/s/eV) | ? | |
Photon irradiance (µmol m-2 s-1 nm-1) | photons | 1 |
Photons | photons | |
photon flux (µmol/m2/s/nm) | photons | 1 |
PPFD | photons | |
red [photons/s/nm] | photons | 1 |
quanta | photons | |
Counts | ? | |
Intensity (counts) | ? | |
Helligkeit | | |
luminance | ? | |
red (lm) | ? | |
"""
"""Head | quantity, `?` where it is refused | factor to plain numbers."""


@pytest.mark.parametrize("line", MEANINGS.strip().splitlines())
def test_a_head_says_quantity_and_factor(line: str) -> None:
    head, quantity, factor, _ = (part.strip() for part in line.split("|"))
    unit = unit_of(head)
    assert (quantity == "?") == bool(unit.unclear), unit
    if not unit.unclear:
        assert (unit.quantity or "") == quantity
        assert (unit.factor or 1.0) == (float(factor) if factor else 1.0)


NM = np.arange(380.0, 781, 5)
QE = {
    name: peak * np.exp(-(((NM - nm) / width) ** 2))
    for name, peak, nm, width in (
        ("Red", 0.6, 610, 45),
        ("Green", 0.65, 535, 45),
        ("Blue", 0.6, 455, 40),
        ("Clear", 0.75, 560, 160),
    )
}


def rows(columns: Sequence[Sequence[object]], mark: str = ",", decimal: str = ".") -> str:
    return (
        "\n".join(mark.join(str(cell).replace(".", decimal) for cell in row) for row in zip(*columns, strict=True))
        + "\n"
    )


def ppf(values: np.ndarray) -> list[str]:
    return [f"{value:.6f}" for value in values]


T = 0.9 - 0.7 * np.exp(-(((NM - 633) / 12) ** 2))
LED = np.exp(-(((NM - 628) / 14) ** 2))
CARY = (
    "Baseline 100%T,,notch,,\nWavelength (nm),%T,Wavelength (nm),%T,\n"
    + rows([NM[::-1], ppf(100 * np.ones(NM.size)), NM[::-1], ppf(100 * T[::-1]), [""] * NM.size])
    + "\nnotch\nCollection Time: 11/26/2026 9:00:00 AM\nScan Version 6.2.0.1588\nStart (nm)              780.0\n"
)
OCEAN = (
    "Data from FLMS0_0.txt Node\n\nDate: Thu Nov 26 09:00:00 CET 2026\nUser: me\nSpectrometer: FLMS0\nTrigger mode: 0\n"
    "Integration Time (sec): 1.000000E-1\nScans to average: 10\nXAxis mode: Wavelengths\nNumber of Pixels in Spectrum: 81\n"
    ">>>>>Begin Spectral Data<<<<<\n" + rows([NM, ppf(1000 * LED)], "\t")
)
PERKIN_ELMER = (
    "PE UV       SUBTECH     SPECTRUM    ASCII       PEDS        4.00\n   -1\nnotch.asc\n26/11/26\n09:00:00.00\n"
    "#HDR\n-1\n-1\n#GR\nnm\n%T\n1.000000\n0.000000\n780.000000\n-5.000000\n81\n14\n100.0\n20.0\n#DATA\n"
    + rows([NM[::-1], ppf(100 * T[::-1])], "\t")
)
SPECWIN = (
    "[General Information]\nInstrument=CAS 140CT\n[Curve Information]\nName=TL red\nClass=Spectral Radiant Intensity\n"
    "Unit=W/(sr nm)\nLength=81\n[Measurement Conditions]\nIntegrationTime=100\nData\n" + rows([NM, ppf(LED)], "\t", ",")
)
CS_2000 = (
    "File Version,1.0\nData Name,TL\n"
    "No.,Title,Meas. time,Lv,x,y,"
    + ",".join(f"{nm:.0f}" for nm in NM)
    + "\n"
    + "1,TL red,2026/11/26,812.3,0.7012,0.2985,"
    + ",".join(ppf(LED))
    + "\n"
    + "2,TL dim,2026/11/26,81.2,0.7012,0.2985,"
    + ",".join(ppf(LED / 10))
    + "\n"
)
GERMAN = "Sensor;Messung 3\nWellenlänge [nm];QE Rot [%];QE Grün [%];QE Blau [%];QE Klar [%]\n" + rows(
    [NM.astype(int), *(ppf(100 * qe) for qe in QE.values())], ";", ","
)
SEKONIC = "Title,TL red\nMeasuring Mode,Ambient\nIlluminance [lx],12.3\nCIE1931 x,0.7012\n" + "".join(
    f"Spectral Data {nm:.0f}[nm],{value}\n" for nm, value in zip(NM, ppf(LED), strict=True)
)
RAWTOACES = json.dumps(
    {
        "header": {"manufacturer": "A", "model": "B"},
        "spectral_data": {
            "units": "relative",
            "index": {"main": ["R", "G", "B"]},
            "data": {
                "main": {
                    f"{nm:.0f}": [float(QE[name][at]) for name in ("Red", "Green", "Blue")] for at, nm in enumerate(NM)
                }
            },
        },
    }
)

INSTRUMENTS: dict[str, tuple[str, str, Use, dict[str, np.ndarray]]] = {
    "Cary": ("a.csv", CARY, "filter", {"Baseline 100%T": np.ones(NM.size), "notch": T}),
    "Ocean": ("a.txt", OCEAN, "light", {"a": 1000 * LED}),
    "Perkin-Elmer": ("notch.asc", PERKIN_ELMER, "filter", {"notch": T}),
    "Specwin": ("a.isd", SPECWIN, "light", {"TL red": LED}),
    "CS-2000": ("a.csv", CS_2000, "light", {"TL red 2026/11/26": LED, "TL dim 2026/11/26": LED / 10}),
    "Sekonic": ("a.csv", SEKONIC, "light", {"TL red": LED}),
    "rawtoaces": (
        "a.json",
        RAWTOACES,
        "sensor",
        {name: 400 / NM * QE[long] for name, long in (("R", "Red"), ("G", "Green"), ("B", "Blue"))},
    ),
}


@pytest.mark.parametrize("name", INSTRUMENTS)
def test_a_file_of_an_instrument_is_read_as_it_means(tmp_path: Path, name: str) -> None:
    file, text, use, right = INSTRUMENTS[name]
    (tmp_path / file).write_text(text)
    curves = read_curves(tmp_path / file)
    made = used_as(curves, list(curves.values), use)
    assert list(made.values) == list(right)
    for column, values in right.items():
        wave, found = made.samples(column)
        np.testing.assert_array_equal(wave, NM)
        np.testing.assert_allclose(found, values, atol=1.1e-6 * max(values.max(), 1.0))
    if use == "light":
        assert {unit.quantity for unit in made.units.values()} == {"energy"}


def test_a_spreadsheet_is_read_from_its_first_sheet_with_a_table(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    book.active.append(["Report"])
    sheet = book.create_sheet("QE")
    sheet.append(["QE of a sensor"])
    sheet.append(["Wavelength (nm)", *(f"{name} (A/W)" for name in QE)])
    for at, nm in enumerate(NM):
        sheet.append([int(nm), *(float(qe[at]) * nm / 1239.841984 for qe in QE.values())])
    book.save(tmp_path / "qe.xlsx")
    curves = read_curves(tmp_path / "qe.xlsx")
    made = used_as(curves, list(curves.values), "sensor")
    for found, right in zip(made.values.values(), QE.values(), strict=True):
        np.testing.assert_allclose(found, right, rtol=1e-8)


def test_digitized_pairs_keep_their_own_wavelengths_and_doubles_are_averaged(tmp_path: Path) -> None:
    """As WebPlotDigitizer exports clicks: names above X, Y; in no order, some of them twice."""
    (tmp_path / "a.csv").write_text("Red,,Green,\nX,Y,X,Y\n500,20,410,10\n400,8,700,30\n600,50,550,60\n500,22,450,20\n")
    curves = read_curves(tmp_path / "a.csv")
    made = used_as(curves, list(curves.values), "sensor")
    for name, nm, expected in (
        ("Red", [400, 500, 600], [0.08, 0.21, 0.5]),
        ("Green", [410, 450, 550, 700], [0.1, 0.2, 0.6, 0.3]),
    ):
        np.testing.assert_allclose(np.interp(nm, *made.samples(name)), expected, rtol=1e-12)
    assert any("samples at the same wavelength were averaged" in note for note in curves.notes)


@pytest.mark.parametrize(
    ("head", "use", "stated"), [("Relative Response", "sensor", "qe"), ("OD", "filter", "transmission")]
)
def test_a_quantity_that_is_stated_counts(tmp_path: Path, head: str, use: Use, stated: Quantity) -> None:
    (tmp_path / "a.csv").write_text(f"nm,{head}\n400,0.3\n550,0.6\n700,0.2\n")
    curves = read_curves(tmp_path / "a.csv")
    assert list(used_as(curves, [head], use, stated).samples(head)[1]) == [0.3, 0.6, 0.2]


def test_a_folder_of_one_file_each_is_a_sensor_and_lights(tmp_path: Path) -> None:
    """`new` and `evaluate`."""
    for folder in ("qe", "leds"):
        (tmp_path / folder).mkdir()
    for name, values in QE.items():
        (tmp_path / "qe" / f"{name}.csv").write_text(rows([["nm", *NM], ["QE", *ppf(values)]]))
    fine = np.arange(380.0, 781)
    for name, peak in (("go", 505), ("wait", 592), ("stop", 632)):
        spectrum = rows([fine, ppf(np.exp(-(((fine - peak) / 12) ** 2)))], "\t")
        (tmp_path / "leds" / f"{name}.txt").write_text(OCEAN.split("380.0\t")[0] + spectrum)
    (tmp_path / "notch.asc").write_text(PERKIN_ELMER)
    own = ("--lights", tmp_path / "leds")
    for words, said in (
        (("new", "mine", "--qe", tmp_path / "qe", *own, "--folder", tmp_path), "Next: "),
        (("evaluate", tmp_path / "notch.asc", "--sensor", tmp_path / "qe", *own), "transmission, times C"),
    ):
        code, out, err = commanded(*words)
        assert (code, err, said in out) == (0, "", True)
    study = load_study(tmp_path / "mine.yaml")
    np.testing.assert_allclose(study.sensor.qe["R"], np.interp(study.grid.nodes_nm, NM, QE["Red"]), atol=1e-6)
    named = {kind: study.lights.names[at[0]] for kind, at in study.lights.members.items()}
    assert named == {"green": "leds:go", "yellow": "leds:wait", "red": "leds:stop"}


def test_words_of_three_languages_are_channels(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(GERMAN.replace("Klar", "Gelb"), encoding="utf-8")
    code, out, _ = commanded("new", "mine", "--qe", tmp_path / "a.csv", "--folder", tmp_path)
    assert code == 0
    assert "R from QE Rot [%], G from QE Grün [%], B from QE Blau [%], Y from QE Gelb [%]" in out


def test_a_study_with_own_ir_cut_runs_to_1000_nm_with_built_in_lights(tmp_path: Path) -> None:
    nm = np.arange(380, 1011, 5)
    broad, cut = 0.5 * np.exp(-(((nm - 600) / 200.0) ** 2)), np.where(nm < 690, 0.9, 0.01)
    (tmp_path / "qe.csv").write_text(rows([["nm", *nm], *([f"{name} QE", *broad] for name in ("R", "C"))]))
    (tmp_path / "cut.csv").write_text(rows([["nm", *nm], ["%T", *(100 * cut)]]))
    study = load(
        tmp_path,
        "study: ir\nsensor: {files: [{file: qe.csv, columns: {R: R QE, C: C QE}}], clear: C, ir_cut: cut.csv}\n"
        "wavelengths: {start_nm: 400, stop_nm: 1000}\nlights: {builtin: tl16, outside: zero}\ncfas: [RCCC]\n",
    )
    nodes = study.grid.nodes_nm
    expected = np.interp(nodes, nm, cut) * np.interp(nodes, nm, broad)
    np.testing.assert_allclose(study.sensor.qe["C"], expected, rtol=1e-9)
    short = BUILT_IN_LIGHTS["tl16"](WavelengthGrid()).photons
    np.testing.assert_array_equal(study.lights.photons[:, nodes <= 700], short)
    assert not study.lights.photons[:, nodes > 700].any()


def test_daylight_and_filament_go_on_to_1000_nm() -> None:
    long, short = (WavelengthGrid(start_nm=400, stop_nm=nm, step_nm=5) for nm in (1000, 780))
    for name, kelvin in (("d65", 6504.0), ("a", 2855.54)):
        photons = illuminant(long, name)
        np.testing.assert_array_equal(photons[: short.size], illuminant(short, name))
        ends = photons[[short.size - 1, -1]]
        m = np.array([780e-9, 1000e-9])
        body = m**-4 / np.expm1(H * C / (1.380649e-23 * m * kelvin))
        assert ends[1] / ends[0] == pytest.approx(body[1] / body[0], rel=1e-9)


def down(head: str, *columns: np.ndarray, mark: str = ",", before: str = "") -> str:
    nm = np.arange(400, 701, 10)
    lines = [
        mark.join([f"{w:g}", *(f"{v:.6g}" for v in row)]) for w, row in zip(nm, np.stack(columns, axis=1), strict=True)
    ]
    return f"{before}{head}\n" + "\n".join(lines) + "\n"


NM31 = np.arange(400, 701, 10)
SHARE = 0.05 + 0.85 / (1 + np.exp(-(NM31 - 580) / 12.0))
PER_W = SHARE * NM31 * 1e-9 * E_C / (H * C)
OD31 = -np.log10(SHARE)
JASCO = "TITLE\tx\nXUNITS\tAXIS\nYUNITS\t%T\nMINY\t5\nXYDATA\n" + down("", 100 * SHARE, mark="\t").lstrip()
STACKED = "x,y\n" + "".join(f"{w + shift},{v:.5f}\n" for shift in (0, 1.3) for w, v in zip(NM31, SHARE, strict=True))


def in_rows(head: str, row: str) -> str:
    """Rows of a format over the share above."""
    values = enumerate(zip(NM31.tolist(), SHARE.tolist(), strict=True))
    return head + "".join(
        row.format(at=at, wave=wave, share=share, percent=100 * share, inverse=1e7 / wave)
        for at, (wave, share) in values
    )


# Text, use, and which column has the share above, or the words of the refusal.
TRAPS: dict[str, tuple[str, Use, int | str]] = {
    "units under blank": (down("Wavelength (nm),R,G\n,A/W,A/W", PER_W, PER_W), "sensor", 0),
    "words under heads": (down("nm,R,G\n,Responsivity (A/W),Responsivity (A/W)", PER_W, PER_W), "sensor", 1),
    "comment": (down("nm,R", PER_W, before="# all values in A/W, measured 2023\n"), "sensor", 0),
    "Data line": (down("Data\nWavelength (nm),R", PER_W, before="Responsivity (A/W)\n"), "sensor", 0),
    "two heads": (down(",T (%),OD\nWavelength (nm),BP550,BP600", 100 * SHARE, OD31), "filter", 1),
    "title in percent": (down("nm,ND", SHARE / 1.5, before="Transmission in %\n"), "filter", "none is above 1"),
    "T beside OD": (down("nm,Transmission,OD", SHARE, OD31 * 9), "filter", 0),
    "QE beside A/W": (down("nm,QE,SR (mA/W)", SHARE, 1e3 * PER_W), "sensor", 1),
    "neutral density": (down("nm,F1", SHARE, before="Neutral density filters\n"), "filter", 0),
    "along in THz": (f"Frequency THz,{','.join(map(str, NM31))}\nR{',0.5' * 31}\n", "sensor", "something else"),
    "transmission": (down("nm,T", SHARE), "sensor", "transmission is no QE"),
    "A/W of too much": (down("nm,R (A/W)", 9 * PER_W), "sensor", "its largest QE would be"),
    "gain": (down("nm,dB", 3 * SHARE), "filter", "its largest transmission would be"),
    "per mille": (down("nm,T (‰)", 1e3 * SHARE), "filter", "has an unknown unit"),
    "relative response": (down("nm,R", SHARE, before="Relative Response of the sensor\n"), "sensor", "does not tell"),
    "loss": (down("nm,Loss (%)", 100 * SHARE), "filter", "does not tell its quantity"),
    "A": (down("nm, A", OD31 / 2), "filter", "or a name?"),
    "dense": (down("nm,209 OD", 100 * SHARE), "filter", "are no optical density"),
    "wavenumbers": (down("Wavelength,T\ncm-1,%", 100 * SHARE), "filter", "wavelengths in an unknown unit"),
    "Raman": (down("Wavelength,T", SHARE, before="XAxis mode: Raman Shifts\n"), "filter", "something else"),
    "JASCO": (JASCO.replace("AXIS", "NANOMETERS"), "filter", 0),
    "JASCO cm-1": (JASCO.replace("AXIS", "1/CM"), "filter", "something else"),
    "along with a unit": (
        "Responsivity (A/W)," + ",".join(map(str, NM31)) + "\nR," + ",".join(f"{v:.6g}" for v in PER_W) + "\n",
        "sensor",
        0,
    ),
    "along in angstrom": (
        "Wavelength (Å)," + ",".join(map(str, 10 * NM31)) + "\nR," + ",".join(f"{v:.6g}" for v in SHARE) + "\n",
        "sensor",
        0,
    ),
    "decimal comma among points": ("nm;R\n400;0,6\n500;0.5\n700;0.1\n", "sensor", "not a usable number (got '0,6')"),
    "commas for thousands": ("nm;R\n400;1,234\n500;999\n700;3,456\n", "sensor", "a comma may be a decimal mark"),
    "Fortran": (in_rows("nm,R\n", "{wave},{share:.6E}\n").replace("E-", "D-"), "sensor", 0),
    "DN per energy": (down("nm,R DN/nJ/cm2", SHARE), "sensor", "the head has an unknown unit"),
    "per hertz": (down("nm,red W/Hz", SHARE), "light", "the head has an unknown unit"),
    "volts": (down("nm,R V/lx.s", SHARE), "sensor", "the head has an unknown unit"),
    "electrons": (down("nm,R e-/lx/s", SHARE), "sensor", "the head has an unknown unit"),
    "luminance": (down("nm,red cd/m2/nm", SHARE), "light", "the head has an unknown unit"),
    "lumen": (down("nm,red lm/nm", SHARE), "light", "the head has an unknown unit"),
    "dB per mm": (down("nm,T dB/mm", SHARE), "filter", "the head has an unknown unit"),
    "per cm": (down("nm,T 1/cm", SHARE), "filter", "the head has an unknown unit"),
    "inverse cm": (down("nm,T cm-1", SHARE), "filter", "the head has an unknown unit"),
    "ten percent": (down("nm,R", 10 * SHARE / SHARE.max()), "sensor", "are no QE"),
    "percent beside a unit": (
        down("nm,R,G (QE)%", 60 * SHARE / SHARE.max(), 60 * SHARE / SHARE.max()),
        "sensor",
        "are no QE",
    ),
    "internal": (down("nm,N tau_i", SHARE), "filter", "does not tell its quantity"),
    "angstrom": (in_rows("wavelength,R\n", "{wave}0,{share:.6f}\n"), "sensor", "angstrom"),
    "falling wavenumbers": (in_rows("x,R\n", "{inverse},{share:.6f}\n"), "sensor", "wavenumbers"),
    "commented head": (in_rows("#WL,R\n", "{at},{wave},{share:.6f}\n"), "sensor", 0),
    "tabs and nm": (
        "\t"
        + "\t".join(f"{w} nm" for w in NM31)
        + "\nR\t"
        + "\t".join(map(str, 0.25 + SHARE / 9))
        + "\nG\t"
        + "\t".join(f"{s:.6f}" for s in SHARE)
        + "\n",
        "sensor",
        1,
    ),
    "two tables": ("nm,R\n400,1\n500,2\n\nsecond\n400,1\n500,2\n510,3\n", "sensor", "two tables in one file"),
    "some in percent": ("nm,R\n400,10 %\n500,20\n700,30\n", "sensor", "some values have percent signs"),
    "stacked": (STACKED, "sensor", "wavelengths begin again"),
    "points for thousands": ("nm;led\n450;987\n500;1.001\n600;1.250\n650;999\n", "light", "a point may be a decimal"),
    "overflow": ("nm,E\n400,9.9999E+30\n500,1\n600,2\n", "light", "not a usable number"),
    "energies": ("1.8,0.5\n2.2,0.6\n3.1,0.2\n", "sensor", "um, or energies in eV"),
    "two lists": (
        "".join(f"Spectral Data {w}[nm],{0.5}\n" for w in range(380, 781, 5))
        + "".join(
            f"Spectral Data {w}[nm],{v:.6g}\n"
            for w, v in zip(range(400, 701), np.interp(range(400, 701), NM31, SHARE), strict=True)
        ),
        "light",
        0,
    ),
    "long heads": ("a" + "_" * 5000 + "1,x\n400,1\n500,2\n600,3\n", "sensor", "no column wavelength"),
}


@pytest.mark.parametrize("name", TRAPS)
def test_a_trap_is_read_as_meant_or_refused(tmp_path: Path, name: str) -> None:
    text, use, right = TRAPS[name]
    (tmp_path / "file.txt").write_text(text)
    with within(10):
        if isinstance(right, str):
            with one_line(right):
                curves = read_curves(tmp_path / "file.txt")
                used_as(curves, list(curves.values), use)
            return
        curves = read_curves(tmp_path / "file.txt")
        made = used_as(curves, list(curves.values), use)
    found = np.interp(NM31, *made.samples(list(made.values)[right]))
    np.testing.assert_allclose(found, SHARE, rtol=2e-5 if use != "light" else 1e-3)


def test_curves_of_two_lengths_end_where_they_end(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("nm,a,b\n400,1,\n410,2,\n420,3,1\n430,4,2\n440,,3\n")
    curves = read_curves(tmp_path / "a.csv")
    assert [list(wave) for wave, _ in map(curves.samples, ("a", "b"))] == [[400, 410, 420, 430], [420, 430, 440]]
    assert "a: there are no values beyond 400 to 430 nm" in curves.notes


def test_a_comma_before_three_digits_of_every_number_is_a_decimal_mark(tmp_path: Path) -> None:
    path = tmp_path / "german.csv"
    path.write_text(in_rows("nm;R\n", "{wave};{percent:.3f}\n").replace(".", ","))
    np.testing.assert_allclose(read_curves(path).values["R"], 100 * SHARE, rtol=0, atol=6e-4)
