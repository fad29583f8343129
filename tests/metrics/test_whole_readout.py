"""Metrics of the whole readout beside CSDs, which keep their fast routes; what they take is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sweep.base.user_code import UserCode
from sweep.camera.accuracy import Accuracy
from sweep.camera.model import SceneModel
from sweep.designs.block import CurveBlock, edges_of
from sweep.metrics import batch
from sweep.metrics.evaluate import evaluate
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


@pytest.mark.parametrize("at_once", [2**19, 1000])
@pytest.mark.parametrize("name", list(SCENES))
def test_csds_are_those_without_other_metrics_and_these_are_of_the_whole_readout(
    name: str, at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(batch, "_READ_AT_ONCE", at_once)
    block = edges_of(SPACE, 3, 9 if name == "refined" else 69)
    assert block is not None
    columns = evaluate(SceneModel(SCENES[name]), block, user_metrics=[BRIGHTEST])
    alone = evaluate(SceneModel(SCENES[name]), block)
    assert {*columns} == {*alone, "brightest"}
    for column, values in alone.items():
        np.testing.assert_array_equal(columns[column], values, err_msg=column)
    response, _ = SceneModel(SCENES[name]).read(block.curves())
    np.testing.assert_allclose(columns["brightest"], response.max(axis=(1, 2, 3)), atol=1e-9)


def test_a_cfa_without_a_user_metric_is_reported_once() -> None:
    calls = ABSENT.code.loaded.__globals__["CALLS"]
    calls.clear()
    for block in (edges_of(SPACE, 0, SPACE.size), CurveBlock(SPACE.curves(SPACE.points(0, 9), 301))):
        assert block is not None
        columns = evaluate(SceneModel(VIEWS["rounded"]), block, user_metrics=[ABSENT, BRIGHTEST])
        assert np.isnan(columns["absent"]).all()
        assert np.isfinite(columns["brightest"]).all()
    assert calls == [1, 1]
