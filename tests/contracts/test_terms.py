"""Terms that are small or seldom: each alone, against arithmetic of its own, so that none can go unnoticed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sweep
from sweep.camera.model import scene_model
from sweep.camera.noise.merge import merged
from sweep.camera.pixel import Pixel
from sweep.metrics.columns.sensitivity import CFA_SENSITIVITY
from sweep.report.numbers import effect
from sweep.results.answers import Answers
from sweep.runs.kept import CachedCalls
from sweep.runs.workers import Workers


def test_a_code_of_companding_has_the_variance_of_a_uniform_step() -> None:
    """Steps of 256 DN, far above the noise of few electrons: the variance grows by step^2 / 12."""
    knees = [[1_024.0, 1_024.0], [1_024.0 + 256 * 3_200, 4_224.0]]
    linear = {"captures": [{"bits": 20, "well_e": 100_000, "gain_dn_per_e": 8.0}], "read_noise_e": 2.0}
    plain, coded = (Pixel.model_validate(linear | more) for more in ({}, {"companding": knees}))
    electrons = np.array([[1_000.0]])
    before, after = (merged(electrons, np.ones((1, 1)), pixel).variance[0] for pixel in (plain, coded))
    assert before == pytest.approx(8.0**2 * (1_000 + 2.0**2), rel=0.01)
    assert after - before == pytest.approx(256.0**2 / 12, rel=1e-6)


def model_of(**scene: Any) -> Any:
    made = sweep.make_study(cfas=["RGGB"], pixel={"crosstalk": 0.1}, scenarios={"s": scene})
    (space,) = made.study.spaces
    setup = made.study.setup(space, "s").with_all_effects
    return scene_model(setup), setup


ROAD = {
    "target": {"distance_m": 50, "fov_deg": 60, "phase_px": [0, 0]},
    "exposure": {"kind": "fixed", "exposure_s": 0.001},
    "optics": {"f_number": 2},
    "intensity_cd": 100,
}


def unlit(**scene: Any) -> np.ndarray:
    model, setup = model_of(**ROAD, **scene)
    return np.asarray(model.own_views[0].unlit(np.empty((1, 0, setup.camera.grid.size)), model.exposures[0]))


def test_the_background_is_not_dimmed_by_air() -> None:
    on_axis = unlit(background_cd_m2=50.0)
    np.testing.assert_allclose(unlit(background_cd_m2=50.0, visibility_m=30.0), on_axis, rtol=1e-12)
    assert (on_axis > 0).all()


def limit(most: float | None) -> Any:
    constraints = {} if most is None else {CFA_SENSITIVITY: {"max": most}}
    study = sweep.make_study(
        cfas=["RYYCy", "RYNCy"],
        boxes={"any": {"cfa": "RYNCy", "channel": "N", "base": "Y", "to": 0.0}},
        constraints=constraints,
    )
    return study, study.upper_bound()


def test_a_bound_keeps_to_the_light_that_is_allowed_at_most() -> None:
    """Of the light of a CFA most is of its other pixels: a constant, which counts once."""
    study, free = limit(None)
    assert free.curve is not None
    light = float(study.evaluate(N=free.curve).iloc[0][CFA_SENSITIVITY])
    _, loose = limit(light + 0.01)
    assert loose.proven == pytest.approx(free.proven, rel=1e-6)
    _, tight = limit(light - 0.02)
    assert tight.curve is not None
    assert tight.proven < free.proven
    assert float(study.evaluate(N=tight.curve).iloc[0][CFA_SENSITIVITY]) <= light - 0.02 + 1e-6
    others = float(study.evaluate(N=np.zeros(301)).iloc[0][CFA_SENSITIVITY])
    assert limit(others - 0.01)[1].proven == -np.inf


@pytest.mark.parametrize(
    ("direction", "best", "said"),
    [
        ("more", 2.0, "gain"),
        ("more", 0.5, "loss"),
        ("less", 2.0, "loss"),
        ("less", 0.5, "gain"),
        ("less", 1.004, ""),
    ],
)
def test_a_gain_is_more_of_what_is_wanted_and_less_of_what_is_not(direction: Any, best: float, said: str) -> None:
    assert effect(best, 1.0, direction) == said


def answer_of(number: int) -> int:
    return number


class Pool(Workers):
    """Workers that count their calls."""

    def __init__(self) -> None:
        super().__init__(1)
        self.calls = 0

    def unordered(self, calls: Any, _killed: Any = None) -> Iterator[tuple[int, int]]:
        for at, (function, arguments, _) in enumerate(calls):
            self.calls += 1
            yield at, function(*arguments)


def test_answers_of_one_round_are_not_those_of_another(tmp_path: Path) -> None:
    first, again = Pool(), Pool()
    for pool in (first, again):
        cached = CachedCalls(pool, Answers(tmp_path), "a")  # type: ignore[arg-type]
        assert list(cached([(answer_of, (1,), {}), (answer_of, (2,), {})])) == [1, 2]
        assert list(cached([(answer_of, (3,), {}), (answer_of, (4,), {})])) == [3, 4]
    assert (first.calls, again.calls) == (4, 0)
