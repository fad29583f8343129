"""Images of traffic lights: how often a reader errs with each CFA, over distance and light."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...results.output import Output
from ...results.tables import VISION_STREET
from ...vision.detections import ALL, precision_scores
from ...vision.readers import OBSERVER
from ...vision.scenes import SHUFFLED
from ..leaders import answering, label
from ..panels import Line, Lines, Panel, Picture
from ..section import MOST_ROWS, Section, Table
from ..vision import (
    PREDICTORS,
    READER_NAMES,
    Benchmark,
    Lesson,
    Ranks,
    benchmark_of,
    format_interval,
    format_percent,
    lessons_of,
    ranks_of,
)
from ..words import joined

_MOST_LEVELS = 3


@dataclass(frozen=True)
class Vision(Section):
    """The benchmark of a run."""

    benchmark: Benchmark
    ranks: Ranks
    hero: str
    street: tuple[tuple[str, str, str], ...]

    heading = "Images read wrongly"
    leads = True

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it where a study asks for images."""
        if output.study.vision is None:
            return
        benchmark, best, street = benchmark_of(output), answering(output), []
        if VISION_STREET in output.vision:
            scores = precision_scores(output.vision[VISION_STREET], benchmark.reference)
            for row in scores[scores["level"] == ALL].to_dict("records"):
                apart = (
                    ""
                    if row["name"] == benchmark.reference
                    else f"{row['apart']:+.3f} ({row['apart_low']:+.3f} to {row['apart_high']:+.3f})"
                )
                street.append((str(row["name"]), f"{row['average_precision']:.3f}", apart))
        ranks = ranks_of(benchmark, benchmark.main_reader)
        yield cls(benchmark, ranks, "" if best is None else label(best), tuple(street))
        if benchmark.learners:
            yield Lessons(benchmark, tuple(lessons_of(benchmark)))

    @property
    def _who(self) -> str:
        return READER_NAMES[self.benchmark.main_reader]

    @property
    def answer(self) -> list[str]:
        """Who errs less than with the reference, and whether the separation predicts it, for each reader that learns."""
        benchmark, readers = self.benchmark, self.benchmark.learners or [OBSERVER]
        if len(benchmark.designs) == 1:
            error = format_percent(benchmark.error(benchmark.reference, readers[0], SHUFFLED))
            return [f"With {benchmark.reference}, the {READER_NAMES[readers[0]]} errs on {error} % of the images."]
        found = "; ".join(f"the {READER_NAMES[reader]} {self._compared(reader)}" for reader in readers)
        lines = [f"Against {benchmark.reference} (percent of the images), {found}."]
        ranks = {reader: ranks_of(benchmark, reader).between.get("csd") for reader in readers}
        told = [format_interval(csd) for csd in ranks.values() if csd]
        if told:
            lines.append(
                f"Rank correlation of the color separation with their errors at one distance and light: **{' and '.join(told)}**."
            )
        return lines

    def _compared(self, reader: str) -> str:
        groups = dict[str, list[str]]()
        for design in self.benchmark.designs:
            if design != self.benchmark.reference:
                difference = self.benchmark.difference(design, SHUFFLED, reader)
                sure = difference.excludes_zero
                word = (
                    "shows no difference"
                    if not sure
                    else "errs less often"
                    if difference.value < 0
                    else "errs more often"
                )
                groups.setdefault(word, []).append(f"{design} {100 * difference.value:+.1f}" if sure else design)
        return ", ".join(f"{word} with **{', '.join(names)}**" for word, names in groups.items())

    @property
    def limits(self) -> list[str]:
        """Errors of all readers, predictors, streets."""
        benchmark, lines = self.benchmark, list[str]()
        for reader in benchmark.learners:
            errors = []
            for design in benchmark.designs:
                times = benchmark.times_observer(design, reader, benchmark.vision.distances_m).value
                more = f" ({times:.2f})" if np.isfinite(times) else ""
                errors.append(f"{design} {100 * benchmark.error(design, reader, SHUFFLED).value:.1f}{more}")
            lines.append(
                f"Percent read wrongly by the {READER_NAMES[reader]}, and times the ideal observer's (unseen lamps, lenses in any order): {', '.join(errors)}."
            )
        others = [f"{PREDICTORS[n]} {format_interval(v)}" for n, v in self.ranks.between.items() if n != "csd"]
        if others:
            lines.append(f"Rank correlations of other predictors: {', '.join(others)}.")
        if self.street:
            lines.append(
                f"Streets, average precision of the simplest detector: {', '.join(f'{name} {score}' for name, score, _ in self.street)}."
            )
        return lines

    @property
    def picture(self) -> Picture | None:
        """Errors over distance, a panel for each light."""
        rows, panels = self.ranks.conditions, list[Panel]()
        levels = list(self.benchmark.vision.levels.items())[:_MOST_LEVELS]
        for level, of in levels:
            here, lines = rows[rows["level"] == level].sort_values("distance_m"), dict[str, Line]()
            for design, line in here.groupby("design", sort=False):
                least = 100 * line[OBSERVER].to_numpy(dtype=float) if OBSERVER in line else None
                lines[str(design)] = Line(
                    line["distance_m"].to_numpy(dtype=float), 100 * line["error"].to_numpy(dtype=float), least
                )
            panels.append(
                Lines(f"{level}, {of.illuminance_lx:g} lx: wrong / %", "distance / m", lines, self.hero, height=260)
            )
        caption = (
            f"Lines: the {self._who}. Bands go down to the ideal observer, which knows how images come about. Errors to expect by its probabilities."
            if OBSERVER in rows
            else f"Lines: the {self._who}."
        )
        return Picture(
            tuple(panels),
            f"Images read wrongly over distance in {joined([level for level, _ in levels])}.",
            caption,
            columns=min(2, len(panels)),
        )

    @property
    def table(self) -> Table | None:
        """Errors of each design with their intervals."""
        rows = []
        for design in self.benchmark.designs[:MOST_ROWS]:
            cells = [
                format_percent(self.benchmark.error(design, reader, SHUFFLED)) for reader in self.benchmark.readers
            ]
            apart = (
                ""
                if design == self.benchmark.reference
                else format_percent(self.benchmark.difference(design, SHUFFLED))
            )
            rows.append((design, *cells, apart))
        return Table(
            (
                "wrong / %",
                *(READER_NAMES[reader] for reader in self.benchmark.readers),
                f"{self._who}, less that of {self.benchmark.reference}",
            ),
            tuple(rows),
        )


@dataclass(frozen=True)
class Lessons(Section):
    """Errors of readers over the number of images that they have learned from."""

    benchmark: Benchmark
    lessons: tuple[Lesson, ...]

    heading = "What a reader learns"

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:  # noqa: ARG003
        """Yield none: it stands after the images."""
        yield from ()

    @property
    def answer(self) -> list[str]:
        """How near the bound readers come, and what the separation predicts on the way."""
        lines = []
        for reader in self.benchmark.learners:
            own = [lesson for lesson in self.lessons if lesson.reader == reader]
            first, last = (sorted(t for t in lesson.times.values() if np.isfinite(t)) for lesson in (own[0], own[-1]))
            if not last:
                lines.append("The ideal observer reads all of these images rightly.")
                continue
            text = f"The {READER_NAMES[reader]} errs {last[0]:.2f} to {last[-1]:.2f} times as often as the ideal observer after {own[-1].images:,} images ({first[0]:.2f} to {first[-1]:.2f} after {own[0].images:,})"
            if np.isfinite(own[-1].csd.value):
                text += f"; the rank correlation of the color separation with its errors goes from {own[0].csd.value:.2f} to {own[-1].csd.value:.2f}"
            lines.append(f"{text}.")
        ideal = ranks_of(self.benchmark, OBSERVER).between.get("csd")
        if ideal is not None:
            lines.append(f"With those of the ideal observer it is {format_interval(ideal)}.")
        return lines

    @property
    def short(self) -> str:
        """All of it."""
        return " ".join(self.answer)

    @property
    def picture(self) -> Picture | None:
        """Errors over the observer's, a panel for each reader."""
        panels = []
        for reader in self.benchmark.learners:
            own = [lesson for lesson in self.lessons if lesson.reader == reader]
            images = np.array([lesson.images / 1000 for lesson in own])
            lines = {
                name: Line(images, np.array([lesson.times[name] for lesson in own])) for name in self.benchmark.designs
            }
            panels.append(
                Lines(
                    f"{READER_NAMES[reader]}: times the observer's error",
                    "images / 1,000",
                    lines,
                    log_x=True,
                    log_y=True,
                    height=260,
                )
            )
        return Picture(
            tuple(panels),
            "Errors of readers over the ideal observer's, over the images that they have learned from.",
            "Each reader is trained anew for each number of images; each image is seen once.",
            columns=2,
        )
