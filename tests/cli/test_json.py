"""`--json`: one object on stdout, everything else on stderr; `--quiet`: errors alone."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from ..build import SCENES
from ..commanded import COMMANDS, commanded
from ..conftest import MEASURED, ROOT, draw_nothing

SECTION = (ROOT / "studies" / "guide" / "reference.md").read_text().split("## JSON objects")[1].split("## ")[0]
DOCUMENTED = dict(re.findall(r"^\| `(\w+)` \| (.*) \|$", SECTION, re.MULTILINE))


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study and its finished run in `out/scenes`."""
    base = tmp_path_factory.mktemp("json")
    (base / "scenes.yaml").write_text(SCENES)
    with pytest.MonkeyPatch.context() as patch:
        draw_nothing(patch)
        assert commanded("run", base / "scenes.yaml", "--output", base / "out", "--jobs", 1)[0] == 0
    return base


def arguments(base: Path, command: str) -> tuple[object, ...]:
    folder = base / "out" / "scenes"
    return {
        "run": (base / "scenes.yaml", "--output", base / "out"),
        "check": (base / "scenes.yaml",),
        "plan": (base / "scenes.yaml",),
        "new": ("mine", "--folder", base / "mine", "--force"),
        "export": (folder, "--design", "0", "--output", base / "exported"),
        "report": (folder,),
        "evaluate": (folder,),
        "describe": (next(MEASURED.glob("*.csv")), "--output", base / "pictures"),
        "list": (base, "--output", base / "out"),
        "status": (folder, "--verify"),
        "compare": (folder, folder, "--output", base / "compared"),
        "audit": (folder,),
    }[command]


@pytest.mark.usefixtures("plain_pictures")
@pytest.mark.parametrize(
    "command",
    sorted(
        COMMANDS
        & {
            "run",
            "check",
            "plan",
            "new",
            "evaluate",
            "describe",
            "list",
            "status",
            "compare",
            "audit",
            "export",
            "report",
        }
    ),
)
def test_a_command_says_one_documented_object(base: Path, command: str) -> None:
    code, out, _ = commanded(command, *arguments(base, command), "--json")
    assert code == 0
    facts = json.loads(out)
    documented = "run" if command == "report" else command
    assert {f"`{key}`" for key in facts} <= set(re.findall(r"`\w+`", DOCUMENTED[documented]))
    code, out, said = commanded(command, *arguments(base, command), "--json", "--quiet")
    assert (code, said) == (0, "")
    assert json.loads(out).keys() == facts.keys()
    code, out, said = commanded(command, *arguments(base, command), "--quiet")
    assert (code, out, said) == (0, f"{base / 'out' / 'scenes'}\n" if command == "run" else "", "")


def test_a_run_that_fails_is_an_object_with_its_faults(tmp_path: Path) -> None:
    (tmp_path / "bad.yaml").write_text(SCENES.replace("left_nm", "lefd_nm", 1))
    code, out, _ = commanded("run", tmp_path / "bad.yaml", "--json")
    (run,) = json.loads(out)["runs"]
    assert (code, run["exit_code"]) == (2, 2)
    assert run["faults"]
