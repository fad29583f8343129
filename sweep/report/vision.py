"""The benchmark of vision as a run left it: errors of each design and reader, with intervals."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
import pandas as pd

from ..base.cache import Cache
from ..base.types import FloatArray
from ..metrics.share import told_share
from ..results.output import Output
from ..results.tables import VISION, VISION_CONDITIONS
from ..vision.scenes import UNSEEN, states_of
from ..vision.scores import Interval, confusion_matrix, mean_of, nested_weights
from ..vision.section import Vision

OBSERVER, NETWORK, HALF = "observer", "network", "half"
READER_NAMES = {OBSERVER: "ideal observer", NETWORK: "network", HALF: "network, half of the images"}
_REFERENCE = "RGGB"


@dataclass(frozen=True, eq=False)
class Benchmark:
    """The images of a run and what was said of them. `images`, `conditions`: the tables as the run wrote them."""

    vision: Vision
    seed: int
    images: pd.DataFrame
    conditions: pd.DataFrame

    @cached_property
    def designs(self) -> list[str]:
        """Names of the designs, in order."""
        return list(dict.fromkeys(self.images["name"]))

    @property
    def reference(self) -> str:
        """The design with which the others are compared."""
        return _REFERENCE if _REFERENCE in self.designs else self.designs[0]

    @cached_property
    def readers(self) -> list[str]:
        """Readers of the images."""
        return [reader for reader in READER_NAMES if self.images[reader].notna().any()]

    @property
    def judge(self) -> str:
        """By whom designs are compared: the network, or without one the observer."""
        return NETWORK if NETWORK in self.readers else OBSERVER

    def _answers(self, order: str, lamps: str = UNSEEN) -> pd.DataFrame:
        return self.images[(self.images["order"] == order) & (self.images["lamps"] == lamps)]

    @lru_cache  # noqa: B019  (a benchmark lives as long as its report)
    def wrong(self, reader: str, order: str, lamps: str = UNSEEN) -> pd.DataFrame:
        """1 where an image was read wrongly, a row for each scene (seed, image), a column for each design."""
        rows = self._answers(order, lamps)
        rows = rows.assign(wrong=(rows[reader] != rows["state"]).astype(float))
        return rows.pivot(index=["seed", "image"], columns="name", values="wrong")[self.designs]

    @lru_cache  # noqa: B019
    def weights(self, order: str, lamps: str = UNSEEN) -> FloatArray:
        """Bootstrap weights of the scenes of `wrong`, the same for all designs and readers."""
        seeds = self.scenes(order, lamps)["seed"].to_numpy()
        return nested_weights(seeds, np.random.default_rng((self.seed, 99)))

    def error(self, design: str, reader: str, order: str, lamps: str = UNSEEN) -> Interval:
        """Share of images that were read wrongly."""
        return mean_of(self.wrong(reader, order, lamps)[design].to_numpy(), self.weights(order, lamps))

    def difference(self, design: str, order: str) -> Interval:
        """Error of a design less that of the reference, on the same scenes."""
        wrong = self.wrong(self.judge, order)
        return mean_of((wrong[design] - wrong[self.reference]).to_numpy(), self.weights(order))

    def scenes(self, order: str, lamps: str = UNSEEN) -> pd.DataFrame:
        """Contents of the scenes of `wrong`, in the same order."""
        rows = self._answers(order, lamps)
        return rows[rows["name"] == self.designs[0]].sort_values(["seed", "image"])

    def said(self, design: str, reader: str, order: str) -> pd.DataFrame:
        """Answers on unseen lamps: columns state, said, p."""
        rows = self._answers(order)
        rows = rows[rows["name"] == design]
        return rows[["state", reader, f"{reader}_p"]].set_axis(["state", "said", "p"], axis=1)

    def confusion(self, design: str, reader: str, order: str) -> pd.DataFrame:
        """Counts of each state (row) said to be each (column)."""
        states, rows = list(states_of(self.vision)), self.said(design, reader, order)
        truth, said = (np.array([states.index(value) for value in rows[column]]) for column in ("state", "said"))
        return pd.DataFrame(confusion_matrix(truth, said, len(states)), states, states)


_benchmarks: Cache[tuple[Path, str], Benchmark] = Cache(2)
"""The latest ones, whose sentences, tables and figures share what they need."""


def benchmark_of(output: Output) -> Benchmark:
    """The benchmark of a run whose study asks for one."""
    vision = output.study.vision
    assert vision is not None
    tables = output.vision[VISION], output.vision[VISION_CONDITIONS]
    key = (output.folder, output.provenance.fingerprint)
    return _benchmarks.get(key, lambda: Benchmark(vision, output.study.seed, *tables))


def said_interval(found: Interval, digits: int = 2) -> str:
    """A value with its interval in words."""
    return f"{found.value:.{digits}f} ({found.low:.{digits}f} to {found.high:.{digits}f})"


def said_percent(found: Interval) -> str:
    """A share with its interval, in percent, without the sign."""
    value, low, high = (told_share(share).removesuffix("%") for share in (found.value, found.low, found.high))
    return f"{value} ({low} to {high})"
