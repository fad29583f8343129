"""Studies that tests run: texts, files, runs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from sweep.api.new import new_study
from sweep.base.errors import StudyError, SweepError
from sweep.report.page import plain, report_of
from sweep.results.output import Output, read_output
from sweep.runs import run_study
from sweep.study import Study, load_study

STUDY = """\
study: tiny
sensor: ar0820
lights: tl16
scenarios:
  chart: {exposure: {kind: white_patch}}
  dim: {exposure: {kind: fixed, exposure_s: 0.002}}
cfas: [RGGB, RYYCy, RYNCy]
designs:
  mine: {cfa: RYNCy, channel: N, base: Y, to: G, at: {left_nm: 606, left_width_nm: 36, right_nm: 646, right_width_nm: 7}}
sweeps:
  edges:
    cfa: RYNCy
    channel: N
    base: Y
    to: G
    grid:
      left_nm: {min: 590, max: 690, count: COUNT}
      left_width_nm: [5, 10]
      right_nm: {min: 640, max: 690, count: 51}
      right_width_nm: [5, 25]
constraints:
  sensitivity: {min: 0.9}
search: {starts: 4, max_evaluations: 200}
"""


def study_file(folder: Path, count: int = 26) -> Path:
    path = folder / "tiny.yaml"
    path.write_text(STUDY.replace("COUNT", str(count)))
    return path


def ran(study: Study, output: Path, jobs: int) -> list[tuple[str, int, int]]:
    seen: list[tuple[str, int, int]] = []
    run_study(study, output, jobs, lambda *call: seen.append(call))
    return seen


def stopband_study(
    name: str,
    grid: str,
    before: str = "",
    after: str = "",
    cfas: str = "[RGGB, RYNCy]",
    curves: str = "sensor: ar0820\nlights: tl16\n",
) -> str:
    """A study that sweeps the edges of a stopband over a grid; `before` and `after`: its sections around CFAs and sweep."""
    return f"""\
study: {name}
{curves}{before}cfas: {cfas}
sweeps:
  edges:
    cfa: RYNCy
    channel: N
    base: Y
    to: G
    grid: {grid}
{after}"""


SCENES = stopband_study(
    "scenes",
    "{left_nm: [600, 610], left_width_nm: 20, right_nm: 650, right_width_nm: 10}",
    before="""\
wavelengths: {step_nm: 5}
pixel: {read_noise_e: 2, offset_dn: 168}
scenarios:
  road:
    target: {fov_deg: 60, phase_px: any}
    optics: {f_number: 2}
    noise: true
    each: {target.distance_m: [150, 250]}
tolerance_dn: 5
""",
)

LARGE = stopband_study(
    "large",
    """
      left_nm: {min: 580, max: 620, count: LEFT}
      left_width_nm: {min: 5, max: 40, count: 25}
      right_nm: {min: 640, max: 680, count: 50}
      right_width_nm: {min: 5, max: 40, count: 40}""",
    after="constraints: {sensitivity: {min: 0.9}}\n",
)


def large(folder: Path, left: int) -> Path:
    path = folder / "large.yaml"
    path.write_text(LARGE.replace("LEFT", str(left)))
    return path


BASE = """\
study: tiny
sensor: ar0820
lights: tl16
cfas: [RGGB, RYNCy]
designs:
  mine: {cfa: RYNCy, channel: N, base: Y, to: G, at: {left_nm: 600, left_width_nm: 10, right_nm: 650, right_width_nm: 10}}
sweeps:
  edges:
    cfa: RYNCy
    channel: N
    base: Y
    to: G
    grid:
      left_nm: {min: 590, max: 610, count: 3}
      left_width_nm: [5, 10]
      right_nm: 650
      right_width_nm: {min: 5, max: 25, count: 2}
constraints:
  sensitivity: {min: 0.9}
search:
  space: edges
"""


def load(tmp_path: Path, text: str) -> Study:
    path = tmp_path / "tiny.yaml"
    path.write_text(text, encoding="utf-8")
    return load_study(path)


def output_of(folder: Path, text: str) -> Output:
    """What a run of a study leaves in `out` of a folder."""
    ran(load(folder, text), folder / "out", 1)
    return read_output(folder / "out")


def issues(tmp_path: Path, text: str) -> list[str]:
    with pytest.raises(StudyError) as caught:
        load(tmp_path, text)
    return [str(issue).replace(f"{tmp_path}/", "") for issue in caught.value.issues]


@contextmanager
def one_line(*said: str, alone: bool = True) -> Iterator[None]:
    """What is done here is refused with one fault, on one line, which has these words; or with others beside it."""
    with pytest.raises(SweepError) as caught:
        yield
    lines = [str(issue) for issue in caught.value.issues]
    assert len(lines) == 1 or not alone, lines
    assert not any("\n" in line for line in lines)
    assert any(all(words in line for words in said) for line in lines), lines


def made(folder: Path, name: str = "mine", qe: Path | None = None, lights: Path | None = None) -> Path:
    new_study(name, folder=folder / "studies", qe=[qe] if qe else [], lights=[lights] if lights else [])
    return folder / "studies" / f"{name}.yaml"


def text_of(output: Output) -> str:
    """All that a page says, but for its pictures."""
    report = report_of(output)
    tables = [line for section in [report.lead, *report.sections] if section.table for line in section.table.lines]
    pairs = [f"{name}: {words}" for name, words in (*report.conditions, *report.method)]
    return plain("\n".join([report.sentence, *tables, *pairs]))
