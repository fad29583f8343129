"""What helps while a study is written: its JSON Schema, the list of studies, the shell's completion, a quick --help."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from sweep.cli.options import run_folders, study_files
from sweep.runs.listing import list_studies
from sweep.study.document import Document
from sweep.study.editors import SCHEMA_FILE, schema_text, study_schema

from ..build import made, study_file
from ..commanded import commanded
from ..conftest import STUDIES

FILES = sorted(STUDIES.glob("*.yaml"))
HEAVY = ["matplotlib", "pandas", "numba", "colour", "pyarrow", "scipy", "sklearn", "pydantic"]


@cache
def validator() -> jsonschema.Draft7Validator:
    schema = study_schema()
    jsonschema.Draft7Validator.check_schema(schema)
    return jsonschema.Draft7Validator(schema)


def errors(data: Any) -> list[str]:
    return [error.message for error in validator().iter_errors(data)]


def test_the_shipped_schema_equals_the_output_of_the_command(tmp_path: Path) -> None:
    assert commanded("schema", "--output", tmp_path / SCHEMA_FILE)[0] == 0
    assert (tmp_path / SCHEMA_FILE).read_text(encoding="utf-8") == (STUDIES / SCHEMA_FILE).read_text(encoding="utf-8")
    assert json.loads(schema_text()) == study_schema()


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_study_fits_the_schema(path: Path) -> None:
    assert errors(Document(path).data) == []


def test_a_new_study_fits_the_schema(tmp_path: Path) -> None:
    assert errors(Document(made(tmp_path)).data) == []


@pytest.mark.parametrize(
    ("more", "fits"),
    [
        ({"cfas": {"RGGB": None, "RGBW": {"tile": [["R", "G"], ["B", "W"]]}}}, True),
        ({"scenarios": {"a": {"noise": True}, "b": {"noise": {"read_noise_e": 1}}, "c": {"noise": False}}}, True),
        ({"objective": {"sum": {"csd_yellow_red": 2}}}, True),
        ({"sensor": "of_a_package"}, True),
        ({"sensr": "ar0820"}, False),
        ({"scenarios": {"x": {"target": {"fov_deg": 60}}}}, False),
        ({"scenarios": {"x": {"each": {"exposure.level": "0.5"}}}}, False),
        ({"tolerance_dn": "0.1"}, False),
        ({"objective": {"minimun": {"csd_yellow_red": 1}}}, False),
    ],
)
def test_short_forms_fit_the_schema_and_misspelled_keys_do_not(more: dict[str, Any], fits: bool) -> None:
    small = {"study": "a", "sensor": "ar0820", "lights": "tl16", "cfas": ["RGGB"]}
    assert (errors(small | more) == []) == fits


def test_studies_are_listed_with_the_broken_ones(tmp_path: Path) -> None:
    study_file(tmp_path)
    (tmp_path / "broken.yaml").write_text("study: broken\nsensr: ar0820\nlights: tl16\ncfas: [RGGB]\n")
    (tmp_path / "worse.yml").write_text("[")
    lines = list_studies(tmp_path, output=tmp_path / "out").lines
    assert [line.split()[0] for line in lines] == ["broken", "tiny", "worse", "3"]
    assert "sensr: unknown key" in lines[0]
    assert "not run" in lines[1]
    assert not (tmp_path / "out").exists()


def test_an_interrupted_and_a_changed_run_are_reported(tmp_path: Path) -> None:
    from sweep.results.folder import begin
    from sweep.results.identity import run_facts
    from sweep.study import load_study

    path = study_file(tmp_path)
    begin(tmp_path / "out" / "tiny", run_facts(load_study(path)))
    assert "interrupted" in list_studies(tmp_path, output=tmp_path / "out").lines[0]
    path.write_text(path.read_text() + "seed: 77\n")
    assert "changed since it was run" in list_studies(tmp_path, output=tmp_path / "out").lines[0]


def test_the_shell_completes_studies_and_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (
        "studies/one.yaml",
        "studies/two.yml",
        "studies/[x].yaml",
        "outputs/one/manifest.json",
        "outputs/none/x.txt",
    ):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    monkeypatch.chdir(tmp_path)
    assert study_files("st") == ["studies/[x].yaml", "studies/one.yaml", "studies/two.yml"]
    assert study_files("studies/[") == ["studies/[x].yaml"]
    assert run_folders("") == run_folders("outputs/") == ["outputs/one"]
    requested = {"_SWEEP_COMPLETE": "complete_bash", "COMP_WORDS": "sweep run studies/t", "COMP_CWORD": "2"}
    whole = os.environ | {"PYTHONPATH": str(STUDIES.parent)} | requested
    command = [sys.executable, "-m", "sweep"]
    said = subprocess.run(command, env=whole, capture_output=True, text=True, check=True).stdout
    assert said.splitlines() == ["studies/two.yml"]


def test_help_imports_nothing_heavy() -> None:
    code = "import sys, sweep.cli.app\ntry: sweep.cli.app.app(['--help'])\nexcept SystemExit: pass\nprint(*sys.modules, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not set(HEAVY) & set(done.stderr.split())
