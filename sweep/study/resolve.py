"""From the schema to frozen objects that a runner can work on; everything is checked here, before any work."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..camera.effects import blur
from ..camera.kernel import too_large
from ..camera.mosaic import Mosaic
from ..camera.scene import OBJECT_RESOLUTION, WhitePatchExposure
from ..curves.color import VISIBLE_NM
from ..curves.lights import Lights, Pair, class_pairs
from ..designs.space import DIMENSIONS, Space
from ..errors import StudyError, SweepError
from ..metrics.discrimination import CNR, D_PRIME, noise_names
from ..metrics.evaluate import DESIGNED, WORST, noise_quantities, shiftable
from ..metrics.separation import csd_name
from ..search.solver import ALGORITHMS
from ..types import FloatArray
from .axes import Axis
from .document import Document
from .model import Search, Study
from .schema import CfaSection, StudySection
from .sources import Sources
from .spaces import SpaceBuilder
from .yaml_tree import Key

MOST_DESIGNS = 10**9
_LEAST_VISIBLE = 1e-6
"""Share of a light's photons that the eye must see where its luminous intensity is given."""


class _Resolver:
    """Turns a checked schema into a Study, collecting every fault that it finds."""

    def __init__(
        self, document: Document, section: StudySection, folders: list[Path], kept: Mapping[str, FloatArray] | None
    ) -> None:
        self.document = document
        self.section = section
        self.sources = Sources(document, section.wavelengths, folders, kept)
        self.faults = self.sources.faults
        self.add = self.sources.add
        self.unknown = self.sources.unknown

    def resolve(self) -> Study:
        section = self.section
        sensor = self.sources.sensor(section.sensor)
        lights = self.sources.lights(section.lights)
        mosaics = {name: mosaic for name, cfa in section.cfas.items() if (mosaic := self.mosaic(name, cfa)) is not None}
        if sensor is None or lights is None:
            raise StudyError(self.faults)
        spaces = SpaceBuilder(section, self.sources, sensor, mosaics).spaces()
        self.check_columns(lights)
        self.check_luminances(lights)
        self.check_images()
        self.check_recognition(lights)
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
        self.check_memory(study)
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

    def check_luminances(self, lights: Lights) -> None:
        """Candelas are given of lights, and of a background, that the eye sees."""
        nodes = self.section.wavelengths.nodes_nm
        visible = (nodes >= VISIBLE_NM[0]) & (nodes <= VISIBLE_NM[1])
        share = self.section.wavelengths.integrate(lights.photons * visible)
        dark = [name for name, part in zip(lights.names, share, strict=True) if not part >= _LEAST_VISIBLE]
        allowed = f"photons between {VISIBLE_NM[0]:g} and {VISIBLE_NM[1]:g} nm"
        for name, scenario in self.section.scenarios.items():
            if scenario.intensity_cd is not None and dark:
                problem = f"a light that the eye does not see has no luminous intensity: {dark[0]}"
                self.add(("scenarios", name, "intensity_cd"), problem, scenario.intensity_cd, allowed)
            if scenario.background_cd_m2 and not visible.any():
                problem = "a background on wavelengths that the eye does not see has no luminance"
                self.add(("scenarios", name, "background_cd_m2"), problem, scenario.background_cd_m2, allowed)

    def check_images(self) -> None:
        """Every target makes an image that can be computed."""
        for name, scenario in self.section.scenarios.items():
            refused = blur.too_much(scenario, self.section.pixel)
            if refused is not None:
                key, problem, value, allowed = refused
                self.add(("scenarios", name, *key), problem, value, allowed)

    def check_memory(self, study: Study) -> None:
        """The kernels of every scene and CFA fit into memory. Raises StudyError."""
        for name in study.scenarios:
            for space in study.spaces:
                if (refused := too_large(study.setup(space, name))) is not None:
                    problem, value, allowed = refused
                    self.add(("scenarios", name, "target"), f"{problem} (CFA {space.cfa})", value, allowed)
                    raise StudyError(self.faults)

    def check_recognition(self, lights: Lights) -> None:
        """Its states are signal types, each once, and every scenario has noise."""
        asked = self.section.recognition
        if asked is None:
            return
        seen: dict[str, Pair] = {}
        for pair in class_pairs(asked.states or lights.classes):
            for column in noise_names(pair):  # error_bound_a_b: the bound of a and b, or the error of bound_a and b
                if seen.setdefault(column, pair) != pair and len(set(pair)) == 2:
                    problem = f"the pairs {'/'.join(seen[column])} and {'/'.join(pair)} share the column {column}"
                    self.add(("lights",), problem, None, "other names of signal types")
        for name in asked.states or ():
            if name not in lights.classes:
                self.unknown(("recognition", "states"), "signal type", name, list(lights.classes))
        if asked.states is not None and len(set(asked.states)) < len(asked.states):
            self.add(("recognition", "states"), "a signal type is named twice", asked.states)
        if len(lights.classes) < 2:
            self.add(("recognition",), "there is one signal type only", lights.classes[0], "two or more")
        for name, scenario in self.section.scenarios.items():
            if scenario.noise is None:
                problem = "`recognition` needs noise in every scenario"
                self.add(("scenarios", name, "noise"), problem, None, "noise: true")

    def mosaic(self, name: str, cfa: CfaSection) -> Mosaic | None:
        try:
            return Mosaic.from_name(name) if cfa.tile is None else Mosaic.from_rows(name, cfa.tile)
        except SweepError as error:
            for fault in error.faults:
                self.add(("cfas", name), fault.problem, fault.value, fault.allowed)
            return None

    def check_published(self, lights: Lights, mosaics: Mapping[str, Mosaic]) -> None:
        section = self.section
        columns = [*DESIGNED, *(csd_name(pair) for pair in class_pairs(lights.classes))]
        known = dict.fromkeys([*mosaics, *section.designs, *section.geometry])
        for table, rows in section.published.items():
            for row, values in rows.items():
                path = ("published", table, row)
                if row not in known:
                    self.unknown(path, "CFA, design or geometry", row, list(known))
                for quantity in values:
                    names = [OBJECT_RESOLUTION] if row in section.geometry else columns
                    if row in known and quantity not in names:
                        self.unknown((*path, quantity), "quantity", quantity, names)

    def named_quantities(self, lights: Lights) -> list[str]:
        """Quantities that an objective or a constraint can name."""
        worst = [WORST + name for name in shiftable(lights)] if self.section.production.edge_shift_nm else []
        distances = (csd_name(pair) for pair in class_pairs(lights.classes))
        return [*DESIGNED, *DIMENSIONS, *distances, *worst, *self.noise_quantities(lights)]

    def noise_quantities(self, lights: Lights) -> tuple[str, ...]:
        asked = self.section.recognition
        return () if asked is None else noise_quantities(asked.states or lights.classes)

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
        quantities, noisy = self.named_quantities(lights), self.noise_quantities(lights)
        for name, bound in self.section.constraints.items():
            path = ("constraints", name)
            known = self.check_quantity(path, "quantity", name, quantities)
            of_noise = name in noisy
            if of_noise and self.section.search is not None:
                self.add(path, f"the search does not know {name}", None, "a study without `search`")
            if known and name not in ("sensitivity", "cfa_sensitivity"):
                small = name == "slope_per_nm" or (of_noise and not name.startswith((CNR, D_PRIME)))
                wrong = "min" if small else "max"
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


def resolve(
    document: Document, section: StudySection, folders: list[Path], kept: Mapping[str, FloatArray] | None = None
) -> Study:
    """Make the study; `folders` are searched in order for its files. Raises StudyError with every fault found.

    `kept`: curves to take instead of those in files, see `Sources`.
    """
    return _Resolver(document, section, folders, kept).resolve()
