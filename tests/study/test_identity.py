"""Identity of a run: every leaf of a study, and every file that it reads, is part of its fingerprint."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML

from sweep.base.errors import StudyError
from sweep.results.identity import fingerprint
from sweep.study import load_study

from ..conftest import STUDIES
from ..curve_texts import WAVE, bell, csv
from ..whole_study import WHOLE

Path_ = tuple[Any, ...]
_GROUPS = 4
UNCHANGED = {("title",), ("question",)}
NAMES = {"sensor", "lights", "kind", "space", "cfa", "channel", "base", "to", "exposure"}
"""Keys whose values are names: another one is another study, or none."""


def leaves(node: Any, path: Path_ = ()) -> Iterator[tuple[Path_, Any]]:
    for key, value in node.items() if isinstance(node, dict) else enumerate(node):
        if isinstance(value, dict | list):
            yield from leaves(value, (*path, key))
        else:
            yield (*path, key), value


def with_leaf(tree: dict[str, Any], path: Path_, value: Any) -> dict[str, Any]:
    changed = copy.deepcopy(tree)
    node: Any = changed
    for key in path[:-1]:
        node = node[key]
    node[path[-1]] = value
    return changed


def written(folder: Path, tree: dict[str, Any]) -> Path:
    stream = StringIO()
    YAML(typ="safe", pure=True).dump(tree, stream)
    path = folder / "all.yaml"
    path.write_text(stream.getvalue())
    return path


def others_of(value: Any) -> tuple[Any, ...]:
    """Other values of a kind, near the one that is given, so that one of them is allowed."""
    return (
        (value + 1, value - 1)
        if isinstance(value, int)
        else (value * 0.98, value * 1.02, value / 2, value * 2, value + 10, value - 10)
    )


@pytest.mark.parametrize("group", [0, *(pytest.param(at, marks=pytest.mark.slow) for at in range(1, _GROUPS))])
def test_every_number_of_a_study_is_in_its_fingerprint(tmp_path: Path, group: int) -> None:
    first, seen = fingerprint(load_study(written(tmp_path, WHOLE))), 0
    for path, value in [*leaves(WHOLE)][group::_GROUPS]:
        if isinstance(value, str) or path[-1] in NAMES:
            continue
        for other in others_of(value):
            try:
                changed = load_study(written(tmp_path, with_leaf(WHOLE, path, other)))
            except StudyError:
                continue
            assert fingerprint(changed) != first, path
            seen += 1
            break
        else:
            raise AssertionError(f"no other value is allowed: {path}")
    assert seen > 60 / _GROUPS
    for text in UNCHANGED:
        assert fingerprint(load_study(written(tmp_path, with_leaf(WHOLE, text, "else")))) == first


def test_curves_and_lights_of_the_package_are_in_the_fingerprint() -> None:
    study = load_study(STUDIES / "paper.yaml")
    qe = {name: 1.001 * curve for name, curve in study.sensor.qe.items()}
    photons = 1.001 * study.lights.photons
    for changed in (
        replace(study, sensor=replace(study.sensor, qe=qe)),
        replace(study, lights=replace(study.lights, photons=photons)),
    ):
        assert fingerprint(changed) != fingerprint(study)


CODE = "FILES = ['shift.csv']\ntry:\n    from helpers import own\nexcept ImportError:\n    own = None\n\n\ndef apart(readings):\n    return readings.of('yellow')[:, :, 0] - readings.of('red')[:, :1, 0]\n\napart.unit, apart.label = 'DN', 'gap'\n"
STUDY = """\
study: files
sensor:
  files: [{file: qe.csv, columns: {R: R, G: G, B: B, Y: Y}}]
  ir_cut: cut.csv
lights: {files: [{file: leds.csv, signals: {yellow: [y], red: [r]}}]}
scenarios: {a: {field: {profile: lens.csv, places: any}}}
cfas: [RGGB]
colorants: {catalog: dyes}
designs:
  mixed: {cfa: RGGB, channel: R, base: Y, family: mixture, options: {at_most: 1}, at: {colorant_1: 1, absorbance_1: 0.5}}
metrics: [own.py:apart]
"""


def write_files(folder: Path) -> None:
    """Files of the study."""
    curves = [0.1 + 0.6 * bell(at, 45) for at in (610, 540, 460, 580)]
    csv(folder, "wavelength_nm,R,G,B,Y", WAVE, *curves, name="qe.csv")
    csv(folder, "wavelength_nm,ir_cut", WAVE, np.where(WAVE < 680, 0.95, 0.1), name="cut.csv")
    csv(folder, "wavelength_nm,y,r", WAVE, bell(590, 9), bell(630, 9), name="leds.csv")
    (folder / "dyes").mkdir()
    csv(folder, "wavelength_nm,absorbance", WAVE, bell(620, 20), name="dyes/blue.csv")
    (folder / "lens.csv").write_text("height_mm,cra_deg\n0,0\n1,5\n2,9\n3,12\n")
    (folder / "own.py").write_text(CODE)
    (folder / "helpers").mkdir()
    (folder / "helpers" / "__init__.py").write_text("import deeper\n")
    (folder / "deeper.py").write_text("SHIFT = 1\n")
    (folder / "shift.csv").write_text("shift\n1\n")


@pytest.mark.parametrize(
    "name", ["qe.csv", "cut.csv", "leds.csv", "lens.csv", "dyes/blue.csv", "own.py", "deeper.py", "shift.csv"]
)
def test_every_file_that_a_study_reads_is_in_its_fingerprint(tmp_path: Path, name: str) -> None:
    write_files(tmp_path)
    (tmp_path / "files.yaml").write_text(STUDY)

    def now() -> str:
        return fingerprint(load_study(tmp_path / "files.yaml", allow_code=True))

    first = now()
    assert now() == first
    text = (tmp_path / name).read_text()
    changed = {"lens.csv": ("2,9", "2,9.1"), "own.py": ("[:, :, 0]", "[:, :, 1]"), "deeper.py": ("1", "2")}
    changed |= {"shift.csv": ("1", "2")}
    if name in changed:
        old, new = changed[name]
    else:
        old = text.splitlines()[21]
        wave, value, *rest = old.split(",")
        new = ",".join([wave, f"{0.9 * float(value):.6g}", *rest])
    assert text.count(old) == 1
    (tmp_path / name).write_text(text.replace(old, new))
    assert now() != first
