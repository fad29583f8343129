"""The commands as a user runs them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ..build import SCENES, study_file
from ..commanded import commanded, sweep
from ..conftest import STUDIES, FinishedFolder


def test_report_stands_alone(finished: FinishedFolder) -> None:
    page = (finished("stopband") / "report.html").read_text()
    assert page.count("<svg ") >= 4
    assert "default-src 'none'" in page
    assert set(re.findall(r"https?://[\w./]+", page)) <= {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}


@pytest.mark.slow
@pytest.mark.long
def test_report_command_makes_it_again(finished: FinishedFolder) -> None:
    folder = finished("stopband")
    page = folder / "report.html"
    before, made_ns = page.read_bytes(), page.stat().st_mtime_ns
    done = sweep("report", str(folder))
    assert done.returncode == 0
    before_s, after_s = (
        re.sub("Took .*\n", "", said) for said in (folder.with_name("stopband.said.txt").read_text(), done.stdout)
    )
    assert after_s == before_s
    assert page.stat().st_mtime_ns > made_ns
    assert page.read_bytes() == before


def test_wrong_input_is_one_line_and_exit_2(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text(study_file(tmp_path).read_text().replace("starts", "start"))
    done = sweep("run", str(wrong), "--output", str(tmp_path / "out"))
    for code, out, said in (
        (done.returncode, done.stdout, done.stderr),
        commanded("check", wrong),
        commanded("run", tmp_path / "absent.yaml"),
        commanded("report", tmp_path),
        commanded("audit", tmp_path),
        commanded("plan", STUDIES / "stopband.yaml", "--tolerance", "inf"),
        commanded("plan", STUDIES / "stopband.yaml", "--tolerance", "nan"),
        commanded("check", tmp_path / "tiny.yaml", "--data", tmp_path / "nowhere"),
    ):
        assert (code, out) == (2, "")
        assert len(said.splitlines()) == 1, said
        assert said.startswith("sweep: ")
        assert "Traceback" not in said
    assert not (tmp_path / "out").exists()


def test_plan_lists_the_effects_of_a_scene(tmp_path: Path) -> None:
    path = tmp_path / "scenes.yaml"
    path.write_text(SCENES.replace("[150, 250]", "[280, 300]"))
    code, out, said = commanded("plan", path, "--tolerance", "50")
    assert code == 0, said
    lines = [line.split() for line in out.splitlines()]
    assert "(2 scenes)" in out  # one plan suits both
    assert {"noise", "blur", "sampling", "phase", "extinction"} <= {line[0] for line in lines if line}
    assert ["extinction", "left", "out", "0", "clear", "air"] in lines
    assert any(line[:2] == ["blur", "computed"] for line in lines)


def test_an_infeasible_study_names_the_constraint_and_writes_nothing(tmp_path: Path) -> None:
    text = study_file(tmp_path).read_text().replace("{min: 0.9}", "{min: 1.01}")
    (tmp_path / "infeasible.yaml").write_text(text)
    code, _, said = commanded("run", tmp_path / "infeasible.yaml", "--output", tmp_path / "out", "--jobs", "1")
    assert code == 3
    assert "no feasible design was found" in said
    assert "constraints.sensitivity: out of reach: sensitivity >= 1.01; the best value found is 1" in said
    assert "Traceback" not in said
    assert not list((tmp_path / "out").iterdir())
