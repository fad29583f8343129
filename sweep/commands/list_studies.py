"""The studies of a folder in a line each, and what has been run of them. Nothing is computed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..base.disk import is_folder, read_facts
from ..base.errors import Fault, StudyError, SweepError
from ..results.folder import held_by
from ..results.lock import holder
from ..results.tables import PROVENANCE
from ..run import output_folder
from ..study import Study, folder_name, load_study

_QUESTION_LETTERS = 70


@dataclass(frozen=True)
class _Line:
    name: str
    designs: str
    state: str
    question: str


def list_lines(folder: Path, outputs: Path, data: Path | None = None) -> list[str]:
    """A line for each study of `folder` (*.yaml, *.yml): name, designs, state of its run in `outputs`, question.

    A study that cannot be loaded is a line that says why. `data` as for `load_study`. Raises StudyError when there is
    no such folder.
    """
    if not is_folder(folder):
        raise StudyError(Fault("no such folder", str(folder), allowed="a folder of study files"))
    try:
        files = sorted(
            path for path in folder.iterdir() if path.suffix in (".yaml", ".yml") and not path.name.startswith(".")
        )
    except OSError as error:
        raise StudyError(Fault(f"cannot be read: {error.strerror or error}", str(folder))) from None
    if not files:
        return [f"No studies in {folder}. `sweep new NAME --folder {folder}` writes one."]
    lines = [_line(path, outputs, data) for path in files]
    wide, wider, widest = (max(len(getattr(line, key)) for line in lines) for key in ("name", "designs", "state"))
    shown = [f"{x.name:<{wide}}  {x.designs:>{wider}}  {x.state:<{widest}}  {x.question}".rstrip() for x in lines]
    finished = sum(line.state.startswith("finished") for line in lines)
    count = f"{len(lines)} {'study' if len(lines) == 1 else 'studies'}"
    return [*shown, f"{count}, {finished} finished. Run one: sweep run {files[0].parent}/NAME.yaml"]


def _line(path: Path, outputs: Path, data: Path | None) -> _Line:
    try:
        study = load_study(path, data)
        state = _state(study, outputs)
    except SweepError as error:
        more = f" (and {len(error.faults) - 1} more)" if error.faults[1:] else ""
        return _Line(path.stem, "", "cannot be loaded", f"{error.faults[0]}{more}")
    name = path.stem if study.name == path.stem else f"{path.stem} ({study.name})"
    return _Line(" ".join(name.split()), f"{study.n_designs:,} designs", state, _short(study))


def _state(study: Study, outputs: Path) -> str:
    folder, note = output_folder(outputs / folder_name(study.name), study)
    held = held_by(folder)
    if held is None:
        return "not run" if note is None else "changed since it was run"
    if holder(folder) is not None:
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
