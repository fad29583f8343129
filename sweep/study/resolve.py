"""From the schema to frozen objects that a runner can work on; everything is checked here, before any work."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from ..datasets.lights import Lights
from ..effects import blur
from ..errors import StudyError, SweepError, nearest
from ..evaluate import DESIGNED, WORST, shiftable
from ..families import CHANNELS, Parameter, build_family
from ..filters import SensorCurves
from ..metrics import class_pairs, csd_name
from ..mosaics import Mosaic
from ..scenes import OBJECT_RESOLUTION, WhitePatchExposure
from ..search import ALGORITHMS
from ..spaces import DIMENSIONS, Filter, Kind, Space
from ..surrogate import surrogate_parameters
from .lines import Document, Key
from .model import Search, Study
from .schema import Axis, CfaSection, DesignSection, Modification, StudySection
from .sources import Sources

MOST_DESIGNS = 10**9


class _Resolver:
    """Turns a checked schema into a Study, collecting every fault that it finds."""

    def __init__(self, document: Document, section: StudySection, folders: list[Path]) -> None:
        self.document = document
        self.section = section
        self.sources = Sources(document, section.wavelengths, folders)
        self.faults = self.sources.faults
        self.add = self.sources.add

    def unknown(self, path: tuple[Key, ...], what: str, value: str, known: list[str]) -> None:
        self.add(path, f"unknown {what}", value, ", ".join(known), nearest(value, known))

    def resolve(self) -> Study:
        section = self.section
        sensor = self.sources.sensor(section.sensor)
        lights = self.sources.lights(section.lights)
        mosaics = {name: mosaic for name, cfa in section.cfas.items() if (mosaic := self.mosaic(name, cfa)) is not None}
        if sensor is None or lights is None:
            raise StudyError(self.faults)
        spaces = self.spaces(sensor, mosaics)
        self.check_columns(lights)
        self.check_images()
        self.check_objective(lights)
        self.check_constraints(lights)
        self.check_published(lights, mosaics)
        search = self.search(spaces)
        if self.faults:
            raise StudyError(self.faults)
        study = Study(
            name=section.study,
            section=section,
            grid=section.wavelengths,
            sensor=sensor,
            lights=lights,
            pixel=section.pixel,
            scenarios=section.scenarios,
            geometry=section.geometry,
            mosaics=mosaics,
            spaces=tuple(spaces),
            objective=section.objective,
            constraints=section.constraints,
            search=search,
            digests=dict(self.sources.digests),
            warnings=tuple(self.sources.warnings),
        )
        if not study.n_designs and search is None:
            self.add(
                ("cfas",), "no designs", None, "a CFA with a curve for each channel, a design, a sweep or a search"
            )
            raise StudyError(self.faults)
        if study.n_designs > MOST_DESIGNS:
            self.add(("sweeps",), "too many designs", f"{study.n_designs:,}", f"at most {MOST_DESIGNS:,}")
            raise StudyError(self.faults)
        return study

    def check_columns(self, lights: Lights) -> None:
        """Every pair of signal types has a column of its own."""
        seen: dict[str, tuple[str, str]] = {}
        for pair in class_pairs(lights.classes):
            name = csd_name(pair)
            if name in seen:
                problem = f"the pairs {'/'.join(seen[name])} and {'/'.join(pair)} share the column {name}"
                self.add(("lights",), problem, None, "other names of signal types")
            seen[name] = pair

    def check_images(self) -> None:
        """Every target makes an image that can be computed."""
        for name, scenario in self.section.scenarios.items():
            refused = blur.too_much(scenario, self.section.pixel)
            if refused is not None:
                key, problem, value, allowed = refused
                self.add(("scenarios", name, *key), problem, value, allowed)

    def mosaic(self, name: str, cfa: CfaSection) -> Mosaic | None:
        try:
            return Mosaic.from_name(name) if cfa.tile is None else Mosaic.from_rows(name, cfa.tile)
        except SweepError as error:
            for fault in error.faults:
                self.add(("cfas", name), fault.problem, fault.value, fault.allowed)
            return None

    def spaces(self, sensor: SensorCurves, mosaics: Mapping[str, Mosaic]) -> list[Space]:
        """Plain CFAs (those whose every channel has a curve), then named designs, then sweeps."""
        section = self.section
        entries = (*section.designs.values(), *section.sweeps.values(), *section.boxes.values())
        changed = {(entry.cfa, channel) for entry in entries for channel in entry.channel}
        spaces = []
        for name, mosaic in mosaics.items():
            missing = False
            for channel in mosaic.channels:
                curve = section.cfas[name].curves.get(channel, sensor.curve_name(name, channel))
                if curve not in sensor.qe:
                    missing = True
                    if (name, channel) not in changed:
                        self.unknown(("cfas", name), f"curve of channel {channel!r}", curve, list(sensor.qe))
            for channel in section.cfas[name].curves:
                if channel not in mosaic.channels:
                    self.unknown(("cfas", name, "curves", channel), "channel", channel, list(mosaic.channels))
            if not missing:
                spaces.append(Space("reference", name, name))
        for name, design in section.designs.items():
            axes: dict[str, tuple[float, ...]] = {key: (value,) for key, value in self.built_in(name, design).items()}
            spaces += self.filtered(
                "design", name, design, axes, ("designs", name, "at"), sensor=sensor, mosaics=mosaics
            )
        for name, sweep in section.sweeps.items():
            axes = {key: axis.points() for key, axis in sweep.grid.items()}
            spaces += self.filtered(
                "sweep", name, sweep, axes, ("sweeps", name, "grid"), sensor=sensor, mosaics=mosaics
            )
        for name, box in section.boxes.items():
            axes = {key: axis.points() for key, axis in box.box.items()}
            spaces += self.filtered("search", name, box, axes, ("boxes", name, "box"), sensor=sensor, mosaics=mosaics)
        return spaces

    def built_in(self, name: str, design: DesignSection) -> Mapping[str, float]:
        """A design's parameters, looked up when it names a built-in filter."""
        if not isinstance(design.at, str):
            return design.at
        known = surrogate_parameters().stopbands
        if design.at not in known:
            self.unknown(("designs", name, "at"), "built-in filter", design.at, list(known))
            return {}
        return known[design.at].model_dump()

    def check_published(self, lights: Lights, mosaics: Mapping[str, Mosaic]) -> None:
        section = self.section
        columns = [*DESIGNED, *(csd_name(pair) for pair in class_pairs(lights.classes))]
        for table, rows in section.published.items():
            for row, values in rows.items():
                path = ("published", table, row)
                known = [*mosaics, *section.designs, *section.geometry]
                if row not in known:
                    self.unknown(path, "CFA, design or geometry", row, known)
                for quantity in values:
                    names = [OBJECT_RESOLUTION] if row in section.geometry else columns
                    if row in known and quantity not in names:
                        self.unknown((*path, quantity), "quantity", quantity, names)

    def check_channels(self, path: tuple[Key, ...], entry: Modification, mosaic: Mosaic | None) -> None:
        """The channels that a family replaces: of the CFA, as many as the family wants, each once."""
        for channel in entry.channel:
            if mosaic is not None and channel not in mosaic.channels:
                self.unknown((*path, "channel"), f"channel of {entry.cfa}", channel, list(mosaic.channels))
        if entry.family not in CHANNELS:
            self.unknown((*path, "family"), "family", entry.family, list(CHANNELS))
        elif len(entry.channel) != CHANNELS[entry.family]:
            self.add((*path, "channel"), f"{entry.family} replaces {CHANNELS[entry.family]} channel(s)", entry.channel)
        elif len(set(entry.channel)) < len(entry.channel):
            self.add((*path, "channel"), "a channel is named twice", entry.channel)

    def filtered(
        self,
        kind: Kind,
        name: str,
        entry: Modification,
        axes: Mapping[str, tuple[float, ...]],
        axes_path: tuple[Key, ...],
        *,
        sensor: SensorCurves,
        mosaics: Mapping[str, Mosaic],
    ) -> list[Space]:
        before = len(self.faults)
        path = axes_path[:-1]
        curves = list(sensor.qe)
        mosaic = mosaics.get(entry.cfa)
        if entry.cfa not in self.section.cfas:
            self.unknown((*path, "cfa"), "CFA", entry.cfa, list(self.section.cfas))
        if entry.base not in curves:
            self.unknown((*path, "base"), "curve", entry.base, curves)
        if isinstance(entry.to, str) and entry.to not in curves:
            self.unknown((*path, "to"), "curve", entry.to, curves)
        self.check_channels(path, entry, mosaic)
        if len(self.faults) > before:
            return []
        base = sensor.curve(entry.base)
        target = sensor.curve(entry.to) if isinstance(entry.to, str) else None if entry.to is None else base * entry.to
        try:
            family = build_family(entry.family, self.section.wavelengths.nodes_nm, base, target, entry.options)
        except SweepError as error:
            for fault in error.faults:
                self.add((*path, "family"), fault.problem, fault.value, fault.allowed)
            return []
        ordered = self.axes(axes, axes_path, family.parameters, open_ended=kind == "search")
        if len(self.faults) > before:
            return []
        made = Filter(family, tuple(entry.channel), entry.base, "" if entry.to is None else str(entry.to))
        return [Space(kind, name, entry.cfa, made, tuple(ordered), gridded=kind != "search")]

    def axes(
        self,
        axes: Mapping[str, tuple[float, ...]],
        path: tuple[Key, ...],
        parameters: Sequence[Parameter],
        *,
        open_ended: bool,
    ) -> list[tuple[float, ...]]:
        """The values of each parameter, in order; one not named has its default, or its range if `open_ended`."""
        known = [parameter.name for parameter in parameters]
        misspelled = [name for name in axes if name not in known]
        for name in misspelled:
            self.unknown((*path, name), "parameter", name, known)
        meant = {nearest(name, known) for name in misspelled}
        ordered = []
        for parameter in parameters:
            usual: tuple[float, ...] = () if parameter.default is None else (parameter.default,)
            if open_ended and not usual:
                usual = (parameter.low, parameter.high)
            values = axes.get(parameter.name, usual)
            if not values and parameter.name not in meant:
                self.add((*path, parameter.name), "missing")
            for value in (min(values), max(values)) if values else ():
                if not parameter.low <= value <= parameter.high:
                    allowed = f"{parameter.low:g} to {parameter.high:g}"
                    self.add((*path, parameter.name), "out of range", value, allowed)
                    break
            ordered.append(values)
        return ordered

    def named_quantities(self, lights: Lights) -> list[str]:
        """Quantities that an objective or a constraint can name."""
        worst = [WORST + name for name in shiftable(lights)] if self.section.production.edge_shift_nm else []
        return [*DESIGNED, *DIMENSIONS, *(csd_name(pair) for pair in class_pairs(lights.classes)), *worst]

    def check_quantity(self, path: tuple[Key, ...], what: str, name: str, known: list[str]) -> bool:
        if name in known:
            return True
        if name.startswith(WORST) and not self.section.production.edge_shift_nm:
            self.add(path, f"{name} needs `production.edge_shift_nm`", None, "a shift above 0")
        else:
            self.unknown(path, what, name, known)
        return False

    def check_objective(self, lights: Lights) -> None:
        known = [name for name in self.named_quantities(lights) if name.removeprefix(WORST) in shiftable(lights)]
        path: tuple[Key, ...] = ("objective",)
        given = self.document.data.get("objective")
        for name in self.section.objective.weights:
            inner = (*path, self.section.objective.rule, name) if isinstance(given, dict) else path
            self.check_quantity(inner, "objective", name, known)

    def check_constraints(self, lights: Lights) -> None:
        for name, bound in self.section.constraints.items():
            path = ("constraints", name)
            known = self.check_quantity(path, "quantity", name, self.named_quantities(lights))
            if known and name not in ("sensitivity", "cfa_sensitivity"):
                wrong = "min" if name == "slope_per_nm" else "max"
                if getattr(bound, wrong) is not None:
                    right = "max" if wrong == "min" else "min"
                    self.add((*path, wrong), f"{name} has no `{wrong}`", getattr(bound, wrong), f"`{right}`")

    def search(self, spaces: list[Space]) -> Search | None:
        section = self.section.search
        if section is None:
            return None
        boxes = {space.name: space for space in spaces if space.kind in ("sweep", "search")}
        names = [*self.section.sweeps, *self.section.boxes]
        scenarios = list(self.section.scenarios)
        chosen = section.space or (names[0] if len(names) == 1 else None)
        if chosen is None:
            self.add(
                ("search", "space"), "missing: the search needs one sweep or box", None, ", ".join(names) or "a sweep"
            )
        elif chosen not in names:
            self.unknown(("search", "space"), "sweep or box", chosen, names)
        elif chosen in boxes and all(min(axis) == max(axis) for axis in boxes[chosen].axes):
            self.add(("search", "space"), "every parameter is fixed", chosen, "one free parameter or more")
        if section.scenario is not None and section.scenario not in scenarios:
            self.unknown(("search", "scenario"), "scenario", section.scenario, scenarios)
        if section.algorithm not in ALGORITHMS:
            what = "algorithm (it must take inequality constraints)"
            self.unknown(("search", "algorithm"), what, section.algorithm, list(ALGORITHMS))
        if chosen not in boxes or section.algorithm not in ALGORITHMS or self.faults:
            return None
        self.check_searched(boxes[chosen])
        levels: tuple[float, ...] = ()
        if section.front is not None:
            axis = Axis(min=section.front.min, max=section.front.max, count=section.front.count)
            levels = axis.points()
        scenario = section.scenario or scenarios[0]
        seen = self.section.scenarios[scenario]
        if seen.drive is not None and isinstance(seen.exposure, WhitePatchExposure):
            self.add(("search", "scenario"), "a search under a pulsed light needs a fixed exposure", scenario)
        return Search(boxes[chosen], scenario, section.algorithm, section.starts, section.max_evaluations, levels)

    def check_searched(self, space: Space) -> None:
        """What the searched family must have for the study's constraints, and the front for its objective."""
        assert space.filter is not None
        own = space.filter.family.dimensions
        for name in self.section.constraints:
            if name in DIMENSIONS and name not in own:
                self.add(
                    ("constraints", name), f"{space.filter.family.kind} has no {name}", None, ", ".join(own) or "none"
                )
        assert self.section.search is not None
        if self.section.search.front is not None and any("sensitivity" in n for n in self.section.objective.weights):
            problem = "the front is searched at levels of sensitivity, which is in the objective"
            self.add(("search", "front"), problem, None, "an objective of CSDs")


def resolve(document: Document, section: StudySection, folders: list[Path]) -> Study:
    """Make the study; `folders` are searched in order for its files. Raises StudyError with every fault found."""
    return _Resolver(document, section, folders).resolve()
