"""List the studies of a folder with their runs, and the spectra that the package ships. Nothing is run."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from ..base.answer import Answer
from ..base.disk import is_folder, read_facts
from ..base.errors import StudyError, SweepError, ValidationIssue
from ..camera.sensor import BUILT_IN_SENSORS
from ..results.folder import run_in
from ..results.identity import run_facts, several_facts
from ..results.lock import in_use
from ..results.tables import PROVENANCE
from ..spectra.builtin.measured_sets import BENKNER, LUXEON, SENSORS, MeasuredSet
from ..spectra.builtin.registry import BUILT_IN_LIGHTS
from ..spectra.builtin.spectra import cards
from ..spectra.builtin.surrogate import FITS
from ..spectra.builtin.surrogate_spectra import surrogate_cards
from ..study import SensorAndLights, Study, folder_name, load_study, sensor_studies_in
from ..study.shipped import shipped_folder, shipped_names
from . import output_folder

_QUESTION_LETTERS = 70
_STUDIES = Path("studies")


@dataclass(frozen=True)
class StudyListing:
    """A study of a folder; `designs` is None, and `question` says why, where it cannot be loaded."""

    name: str
    designs: int | None
    state: str
    question: str


def list_studies(
    folder: Path | str | None = None, data: Path | str | None = None, *, output: Path | str = "outputs"
) -> Answer:
    """List studies: question, number of designs, and whether they have been run.

    Parameters
    ----------
    folder : path-like, optional
        Folder of study files; left out, ``studies``, or the studies of the package where there is no such folder.
    data : path-like, optional
        Folder in which the studies' files are looked for first.
    output : path-like
        Folder of the results of all studies.

    Returns
    -------
    Answer
        A line for each study.

    Raises
    ------
    SweepError
        If there is no such folder.
    """
    shipped = shipped_folder() if folder is None and not is_folder(_STUDIES) else None
    place = shipped or Path(folder or _STUDIES)
    if not is_folder(place):
        raise StudyError(ValidationIssue("no such folder", str(place), allowed="a folder of study files"))
    try:
        files = sorted(
            path for path in place.iterdir() if path.suffix in (".yaml", ".yml") and not path.name.startswith(".")
        )
    except OSError as error:
        raise StudyError(ValidationIssue(f"cannot be read: {error.strerror or error}", str(place))) from None
    studies = [_listed(path, Path(output), None if data is None else Path(data)) for path in files]
    how = "sweep run NAME" if shipped else f"sweep run {place}/NAME.yaml"
    lines = [f"No studies in {place}. `sweep new NAME --folder {place}` writes one."]
    if studies:
        lines = _lines(studies, how)
    others = [name for name in shipped_names() if folder is None and name not in [path.stem for path in files]]
    if others and not shipped:
        lines.append(f"Of the package, by name: {', '.join(others)}.")
    return Answer(lines, {"folder": str(place), "studies": [asdict(study) for study in studies]})


def _lines(studies: Sequence[StudyListing], how: str) -> list[str]:
    """Format studies as a table: name, designs, state, question."""
    counts = ["" if x.designs is None else f"{x.designs:,} designs" for x in studies]
    name_width, count_width = max(len(x.name) for x in studies), max(map(len, counts))
    state_width = max(len(x.state) for x in studies)
    lines = [
        f"{x.name:<{name_width}}  {count:>{count_width}}  {x.state:<{state_width}}  {x.question}".rstrip()
        for x, count in zip(studies, counts, strict=True)
    ]
    finished = sum(x.state.startswith("finished") for x in studies)
    count = f"{len(studies)} {'study' if len(studies) == 1 else 'studies'}"
    return [*lines, f"{count}, {finished} finished. Run one: {how}"]


def _listed(path: Path, outputs: Path, data: Path | None) -> StudyListing:
    try:
        several = sensor_studies_in(path)
        members: tuple[SensorAndLights | None, ...] = (None,) if several is None else several.members
        studies = [load_study(path, data, member=member) for member in members]
        if several is None:
            stated, state = studies[0].name, _state(studies[0], outputs)
        else:
            facts = several_facts(dict(zip(several.members, studies, strict=True)))
            stated, (folder, _) = several.name, output_folder(outputs / folder_name(several.name), facts)
            runs = [run_in(folder / folder_name(study.name)) for study in studies]
            finished = sum(run is not None and run.finished for run in runs)
            state = f"{finished} of {len(runs)} runs finished" if finished < len(runs) else f"finished, {finished} runs"
    except SweepError as error:
        more = f" (and {len(error.issues) - 1} more)" if error.issues[1:] else ""
        return StudyListing(path.stem, None, "cannot be loaded", f"{error.issues[0]}{more}")
    name = path.stem if stated == path.stem else f"{path.stem} ({stated})"
    question = studies[0].section.title or " ".join(studies[0].section.question.split())
    if len(question) > _QUESTION_LETTERS:
        question = question[: _QUESTION_LETTERS - 3].rstrip() + "..."
    return StudyListing(" ".join(name.split()), sum(study.n_designs for study in studies), state, question)


def _state(study: Study, outputs: Path) -> str:
    folder, note = output_folder(outputs / folder_name(study.name), run_facts(study))
    held = run_in(folder)
    if held is None:
        return "not run" if note is None else "changed since it was run"
    if in_use(folder):
        return "running"
    if not held.finished:
        return "interrupted"
    best = (read_facts(folder / PROVENANCE).get("search") or {}).get("best_smooth_objective")
    goal = study.quantities[study.objective.column]
    return "finished" if best is None else f"finished, search found {goal.amount(best)}"


def list_data() -> Answer:
    """Return for each set of spectra its data card: kind, range, license, groups, source, credit and digest."""
    lines, total = [], 0
    sets = [*cards(), *surrogate_cards()]
    groups: dict[str, list[str]] = {}
    for _, name, _ in _measured():
        groups.setdefault(name.partition("/")[0], []).append(name)
    for kind, name, measured in _measured():
        low, high = measured.range_nm
        group, _, own = name.partition("/")
        if name != groups[group][0]:
            continue
        alike = [one.partition("/")[2] for one in groups[group]] if own else []
        what = (
            f"{len(alike)} cameras as `{group}/NAME`, each {measured.what.partition(' behind ')[2]}"
            if own
            else measured.what
        )
        lines += [
            f"{group}: {what}; {low:g} to {high:g} nm, {measured.license}",
            f"  {kind}: {', '.join(measured.names)}",
            *textwrap.wrap(f"names: {', '.join(alike)}", 118, initial_indent="  ", subsequent_indent="    ")
            * bool(own),
            f"  source: {measured.source}",
            *(f"  sha256: {sha256}  {file}" for file, sha256 in measured.digests.items()),
        ]
    for card in sets:
        count = sum(card.groups.values())
        total += count
        origin = "surrogate: modeled, not measured" if card.surrogate else "as published"
        lines += [
            f"{card.name}: {count} {card.kind}s, {card.first_nm:g} to {card.last_nm:g} nm, {card.license}, {origin}",
            f"  groups: {', '.join(f'{group} ({size})' for group, size in card.groups.items())}",
            f"  source: {card.source}",
            f"  credit: {card.credit}",
            f"  sha256: {card.sha256}",
        ]
    lines += [
        f"Sensors: {', '.join(name for name in BUILT_IN_SENSORS if not {*'/@'} & {*name})}, rawtoaces/NAME, "
        f"ar0820@1 to ar0820@{FITS} (further fits of the surrogate, with their tl16); "
        f"lights: {', '.join(name for name in BUILT_IN_LIGHTS if '@' not in name)} "
        f"(ar0820, tl16, tl16_deep_red, filament: surrogates).",
        f"{total} spectra in {len(sets)} sets. A study's tasks name their groups: tasks: {{own: ...}}.",
    ]
    facts = [
        {"name": name, "kind": kind, "what": measured.what, "license": measured.license, "source": measured.source}
        | {"range_nm": measured.range_nm, "curves": measured.names, "sha256": measured.digests}
        for kind, name, measured in _measured()
    ]
    return Answer(lines, {"sets": [asdict(card) for card in sets], "measured": facts})


def _measured() -> list[tuple[str, str, MeasuredSet]]:
    """Return kind, name and set of the measured sensors and lights."""
    lights = ("lights", "luxeon", LUXEON), ("lights", "led_benkner", BENKNER)
    return [*(("sensor", name, measured) for name, measured in SENSORS.items()), *lights]
