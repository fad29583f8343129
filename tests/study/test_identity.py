"""Identity of a run: every leaf of a study, and every file that it reads, is part of its fingerprint."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML

from sweep.base.errors import StudyError
from sweep.results.identity import fingerprint
from sweep.study import load_study

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


WAVE = np.arange(400, 701, 5)
CODE = "def apart(readings):\n    return readings.of('yellow')[:, :, 0] - readings.of('red')[:, :1, 0]\n\napart.unit, apart.label = 'DN', 'gap'\n"
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


def file_texts() -> dict[str, str]:
    """Files of the study, by name."""
    curves = {
        name: 0.1 + 0.6 * np.exp(-(((WAVE - at) / 60) ** 2))
        for name, at in zip("RGBY", (610, 540, 460, 580), strict=True)
    }
    lamps = {name: np.exp(-(((WAVE - at) / 12) ** 2)) for name, at in (("y", 590), ("r", 630))}

    def table(columns: dict[str, np.ndarray]) -> str:
        rows = [",".join(["wavelength_nm", *columns])]
        return (
            "\n".join(
                [
                    *rows,
                    *(",".join(f"{value:.6g}" for value in row) for row in zip(WAVE, *columns.values(), strict=True)),
                ]
            )
            + "\n"
        )

    return {
        "qe.csv": table(curves),
        "cut.csv": table({"ir_cut": np.where(WAVE < 680, 0.95, 0.1)}),
        "leds.csv": table(lamps),
        "lens.csv": "height_mm,cra_deg\n0,0\n1,5\n2,9\n3,12\n",
        "dyes/blue.csv": table({"absorbance": np.exp(-(((WAVE - 620) / 30) ** 2))}),
        "own.py": CODE,
    }


@pytest.mark.parametrize("name", list(file_texts()))
def test_every_file_that_a_study_reads_is_in_its_fingerprint(tmp_path: Path, name: str) -> None:
    texts = file_texts()
    for file, text in texts.items():
        (tmp_path / file).parent.mkdir(exist_ok=True)
        (tmp_path / file).write_text(text)
    (tmp_path / "files.yaml").write_text(STUDY)

    def now() -> str:
        return fingerprint(load_study(tmp_path / "files.yaml", allow_code=True))

    first = now()
    assert now() == first
    changed = {"lens.csv": ("2,9", "2,9.1"), "own.py": ("[:, :, 0]", "[:, :, 1]")}
    if name in changed:
        old, new = changed[name]
    else:
        old = texts[name].splitlines()[30]
        wave, value, *rest = old.split(",")
        new = ",".join([wave, f"{0.9 * float(value):.6g}", *rest])
    assert texts[name].count(old) == 1
    (tmp_path / name).write_text(texts[name].replace(old, new))
    assert now() != first
