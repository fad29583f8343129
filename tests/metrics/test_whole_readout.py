"""Metrics of the whole readout beside CSDs, which keep their fast routes; what they take is told."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from sweep.base.user_code import UserCode
from sweep.camera.accuracy import Accuracy
from sweep.camera.model import SceneModel
from sweep.designs.block import CurveBlock, EdgeBlock, edges_of
from sweep.metrics import batch, registry
from sweep.metrics.batch import CaseReadings
from sweep.metrics.evaluate import evaluate
from sweep.metrics.metric import Metric
from sweep.metrics.quantity import Columns, Quantity, RequestedQuantities
from sweep.metrics.user_metrics import UserMetric

from ..blocks import SPACE, VIEWS

VIEW = VIEWS["any place"]
SCENES = VIEWS | {"refined": replace(VIEW, accuracy=Accuracy(phases_per_px=1, finest_phase_px=1 / 4))}
CODE = """\
import numpy as np


def brightest(readings):
    return readings.dn.max(axis=2)


def absent(readings):
    CALLS.append(len(readings.dn))


brightest.direction, CALLS = "less", []
"""
BRIGHTEST, ABSENT = (UserMetric(UserCode(f"mine.py:{name}", CODE)) for name in ("brightest", "absent"))


class Darkest(Metric):
    """A metric that another file of `metrics/columns` would add."""

    order = 10

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:  # noqa: ARG002
        """Its column."""
        return (Quantity("darkest_dn", "darkest_dn", "the weakest signal", "DN", direction="more", ends=("min",)),)

    def of_readings(self, readings: CaseReadings) -> Columns:
        """The weakest signal in its best channel."""
        return {"darkest_dn": readings.dn.max(axis=2).min(axis=1)}


@pytest.fixture
def darkest(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """One more registered metric."""
    monkeypatch.setattr(registry, "METRICS", (*registry.METRICS, Darkest()))
    registry.quantities_of.cache_clear()
    yield
    registry.quantities_of.cache_clear()


def by_hand(name: str, block: EdgeBlock) -> dict[str, np.ndarray]:
    """Both metrics from the readout of the designs' curves."""
    response, _ = SceneModel(SCENES[name]).read(block.curves())
    best = response.max(axis=3)
    return {"darkest_dn": best.min(axis=(1, 2)), "brightest": best.max(axis=(1, 2))}


@pytest.mark.usefixtures("darkest")
@pytest.mark.parametrize("at_once", [2**19, 1000])
@pytest.mark.parametrize("name", list(SCENES))
def test_csds_are_those_without_other_metrics_and_these_are_of_the_whole_readout(
    name: str, at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(batch, "_READ_AT_ONCE", at_once)
    block = edges_of(SPACE, 3, 9 if name == "refined" else 69)
    assert block is not None
    columns = evaluate(SceneModel(SCENES[name]), block, user_metrics=[BRIGHTEST], metrics=registry.METRICS)
    alone = evaluate(SceneModel(SCENES[name]), block)
    assert {*columns} == {*alone, "darkest_dn", "brightest"}
    for column, values in alone.items():
        np.testing.assert_array_equal(columns[column], values, err_msg=column)
    for column, values in by_hand(name, block).items():
        np.testing.assert_allclose(columns[column], values, atol=1e-9, err_msg=column)


def test_a_cfa_without_a_user_metric_is_reported_once() -> None:
    calls = ABSENT.code.loaded.__globals__["CALLS"]
    calls.clear()
    for block in (edges_of(SPACE, 0, SPACE.size), CurveBlock(SPACE.curves(SPACE.points(0, 9), 301))):
        assert block is not None
        columns = evaluate(SceneModel(VIEWS["rounded"]), block, user_metrics=[ABSENT, BRIGHTEST])
        assert np.isnan(columns["absent"]).all()
        assert np.isfinite(columns["brightest"]).all()
    assert calls == [1, 1]
