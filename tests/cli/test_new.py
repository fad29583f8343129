"""`sweep new`: a study that runs as it is, for the built-in curves and for a user's files."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from sweep.api.channels import channel_of, layout_of
from sweep.api.study_text import scalar
from sweep.base.errors import DataError, OutputError, StudyError
from sweep.study import load_study
from sweep.study.document import Document

from ..build import made
from ..curve_texts import WAVE, bell, csv


@pytest.fixture
def rgbw(tmp_path: Path) -> Path:
    (tmp_path / "data").mkdir()
    columns = (60 * bell(600, 40), 60 * bell(540, 40), 50 * bell(460, 40), 80 * bell(550, 150))
    return csv(tmp_path / "data", "wavelength_nm,red,QE green,B,Clear", WAVE, *columns)


@pytest.fixture
def leds(tmp_path: Path) -> Path:
    columns = [bell(peak, 8) for peak in (450, 505, 591, 605, 628)] + [0 * WAVE]
    return csv(tmp_path, 'wavelength_nm,"royal, blue",gn,"yes",or,"rd: 1",dark', WAVE, *columns, name="leds.csv")


def test_commented_keys_of_a_new_study_work(tmp_path: Path) -> None:
    path = made(tmp_path)
    text = path.read_text()
    opened, count = re.subn(r"^(  )# (?=road|  target|  optics|  noise|slope|csd)", r"\1", text, flags=re.MULTILINE)
    assert count >= 6
    path.write_text(opened)
    study = load_study(path)
    assert {"chart", "road"} == set(study.scenarios)
    assert "slope_per_nm" in study.constraints


def test_files_fill_in_sensor_and_lights(tmp_path: Path, rgbw: Path, leds: Path) -> None:
    path = made(tmp_path, qe=rgbw, lights=leds)
    study = load_study(path)
    (sensor,), (lights,) = study.section.sensor.files, study.section.lights.files
    assert sensor.columns == {"R": "red", "G": "QE green", "B": "B", "C": "Clear"}
    assert (sensor.file, lights.file) == tuple(
        Path(os.path.relpath(file, path.parent)).as_posix() for file in (rgbw, leds)
    )
    assert sensor.scale == 0.01
    assert lights.signals == {"green": ["gn"], "yellow": ["yes"], "orange": ["or"], "red": ["rd: 1"]}
    assert study.objective.column == "csd_yellow_red"
    (sweep_,) = study.section.sweeps.values()
    assert (sweep_.cfa, sweep_.base, sweep_.to) == ("RGBN", "C", "G")


@pytest.mark.parametrize(
    ("column", "channel"),
    [
        *(("R", "R"), ("red", "R"), ("RED", "R"), ("rRed", "R"), ("cCyan", "Cy"), ("wClear", "C"), ("QE_b (1)", "B")),
        *(("White", "W"), ("mono", "C"), ("Cy", "Cy"), ("curve_1", None), ("b-w", None), ("", None)),
    ],
)
def test_a_column_says_its_channel(column: str, channel: str | None) -> None:
    assert channel_of(column) == channel


@pytest.mark.parametrize(
    ("channels", "changed", "base", "to"),
    [
        ("R G B W", "RGBN", "W", "G"),
        ("R G B", "RGNB", "G", "0.1"),
        ("R C", "RCCN", "C", "0.1"),
        ("R G Y Cy", "RYNCy", "Y", "G"),
        ("R Y Cy", "RYNCy", "Y", "0.1"),
        ("G Y", "YGGN", "G", "0.1"),
        ("C", "CCCN", "C", "0.1"),
    ],
)
def test_cfas_are_those_that_the_channels_allow(channels: str, changed: str, base: str, to: str) -> None:
    layout = layout_of({name: 2.0 if name == "G" else 1.0 for name in channels.split()})
    assert (layout.changed, layout.base, layout.to) == (changed, base, to)


def test_two_signal_types_are_enough_and_one_is_refused(tmp_path: Path) -> None:
    two = csv(tmp_path, "wavelength_nm,a,b", WAVE, bell(505, 8), bell(628, 8))
    assert load_study(made(tmp_path, lights=two)).objective.column == "csd_green_red"
    one = csv(tmp_path, "wavelength_nm,a", WAVE, bell(505, 8), name="one.csv")
    with pytest.raises(DataError, match="one signal color"):
        made(tmp_path, "other", lights=one)
    assert not (tmp_path / "studies" / "other.yaml").exists()


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    path = made(tmp_path)
    path.write_text("mine")
    (tmp_path / "studies" / "study.schema.json").write_text("old")
    with pytest.raises(OutputError, match="is there already"):
        made(tmp_path)
    assert path.read_text() == "mine"
    made(tmp_path, "second")
    assert (tmp_path / "studies" / "study.schema.json").read_text() == "old"
    assert not [p for p in (tmp_path / "studies").iterdir() if p.name.startswith(".")]


@pytest.mark.parametrize("name", ["", "a/b", "../up", "mine.yaml", ".hidden", "-x", "a b", "\u00fc", "x" * 101])
def test_a_bad_name_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(StudyError) as caught:
        made(tmp_path, name)
    assert len(caught.value.issues) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "text",
    [
        *(
            "yes",
            "1e5",
            "a, b",
            "it's",
            "a: b",
            '"',
            "\u4fe1",
            "a\nb",
            " x",
            "? red",
            ": green",
        ),
        *("green\x85x", "a\u2028b", "\x07", "\ufeffx", "Off", "~", "\\n", "&a", "a.b-c"),
    ],
)
def test_any_column_name_survives_yaml(tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.yaml"
    path.write_text(
        f"a: {{b: {scalar(text)}}}\nc:\n  - {scalar(text)}  # x\nd: [{scalar(text)}, 1]\n", encoding="utf-8"
    )
    assert Document(path).data == {"a": {"b": text}, "c": [text], "d": [text, 1]}
    assert scalar(text).isprintable()


def test_a_short_range_of_the_sensor_is_the_grid(tmp_path: Path) -> None:
    inside = (WAVE >= 420) & (WAVE <= 690)
    qe = csv(tmp_path, "wavelength_nm,R,C", WAVE[inside], bell(600, 50)[inside], bell(550, 90)[inside])
    study = load_study(made(tmp_path, qe=qe))
    assert (study.grid.start_nm, study.grid.stop_nm) == (420, 690)
