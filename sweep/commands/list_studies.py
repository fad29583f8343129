"""The studies of a folder in a line each, and what has been run of them. Nothing is computed."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ..base.disk import is_folder, read_facts
from ..base.errors import Fault, StudyError, SweepError
from ..results.folder import held_by
from ..results.lock import in_use
from ..results.tables import PROVENANCE
from ..run import output_folder
from ..study import Study, folder_name, load_study

_QUESTION_LETTERS = 70


@dataclass(frozen=True)
class Listed:
    """A study of a folder; `designs` is None, and `question` says why, where it cannot be loaded."""

    name: str
    designs: int | None
    state: str
    question: str

    @property
    def counted(self) -> str:
        """Number of designs, in words."""
        return "" if self.designs is None else f"{self.designs:,} designs"


def studies_of(folder: Path, outputs: Path, data: Path | None = None) -> list[Listed]:
    """Studies of `folder` (*.yaml, *.yml), with the state of their runs in `outputs`.

    `data` as for `load_study`. Raises StudyError when there is no such folder.
    """
    if not is_folder(folder):
        raise StudyError(Fault("no such folder", str(folder), allowed="a folder of study files"))
    try:
        files = sorted(
            path for path in folder.iterdir() if path.suffix in (".yaml", ".yml") and not path.name.startswith(".")
        )
    except OSError as error:
        raise StudyError(Fault(f"cannot be read: {error.strerror or error}", str(folder))) from None
    return [_listed(path, outputs, data) for path in files]


def list_lines(folder: Path, studies: list[Listed]) -> list[str]:
    """A line for each study: name, designs, state, question."""
    if not studies:
        return [f"No studies in {folder}. `sweep new NAME --folder {folder}` writes one."]
    wide, wider, widest = (max(len(getattr(study, key)) for study in studies) for key in ("name", "counted", "state"))
    shown = [f"{x.name:<{wide}}  {x.counted:>{wider}}  {x.state:<{widest}}  {x.question}".rstrip() for x in studies]
    finished = sum(study.state.startswith("finished") for study in studies)
    count = f"{len(studies)} {'study' if len(studies) == 1 else 'studies'}"
    return [*shown, f"{count}, {finished} finished. Run one: sweep run {folder}/NAME.yaml"]


def list_facts(studies: list[Listed]) -> dict[str, Any]:
    """The same as plain values."""
    return {"studies": [asdict(study) for study in studies]}


def _listed(path: Path, outputs: Path, data: Path | None) -> Listed:
    try:
        study = load_study(path, data)
        state = _state(study, outputs)
    except SweepError as error:
        more = f" (and {len(error.faults) - 1} more)" if error.faults[1:] else ""
        return Listed(path.stem, None, "cannot be loaded", f"{error.faults[0]}{more}")
    name = path.stem if study.name == path.stem else f"{path.stem} ({study.name})"
    return Listed(" ".join(name.split()), study.n_designs, state, _short(study))


def _state(study: Study, outputs: Path) -> str:
    folder, note = output_folder(outputs / folder_name(study.name), study)
    held = held_by(folder)
    if held is None:
        return "not run" if note is None else "changed since it was run"
    if in_use(folder):
        return "running"
    if not held.finished:
        return "interrupted"
    found = read_facts(folder / PROVENANCE).get("search") or {}
    best = found.get("best_smooth_objective")
    goal = study.quantities[study.objective.column]
    return "finished" if best is None else f"finished, search found {goal.amount(best)}"


def _short(study: Study) -> str:
    text = " ".join(study.section.question.split())
    return text if len(text) <= _QUESTION_LETTERS else text[: _QUESTION_LETTERS - 3].rstrip() + "..."
