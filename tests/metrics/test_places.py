"""Every distance over sampling phases and field positions, against readings of hundreds of places and own loops."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest

from sweep.camera.model import SceneModel, View
from sweep.camera.phases import phases_at
from sweep.metrics.evaluate import evaluate

from ..hard.scenes import DARK, F2, DesignScene, scene, target
from ..margin import squared_dprime

STATES = ("yellow", "red")
_DIMMED = np.linspace(0.0, 1.0, 4001)


def least_of(model: SceneModel, curves: np.ndarray) -> dict[str, float]:
    """The smallest CSD, pixel CSD, chromatic CSD and d' of yellow and red in the cases of a model."""
    setup = model.setup
    noisy = setup.scene.noise is not None
    read = model.read_with_noise(curves) if noisy else None
    dn = model.read(curves)[0][0] if read is None else read.mean[0]
    dark = model.unlit(curves, model.exposure_s(curves))[0]
    counts = setup.camera.mosaic.counts
    least = dict.fromkeys(("csd", "pixel_csd", "chromatic_csd", "dprime"), np.inf)
    for case in range(len(dn)):
        for one in setup.members["yellow"]:
            for other in setup.members["red"]:
                apart = dn[case, one] - dn[case, other]
                least["csd"] = min(least["csd"], float(np.sqrt((apart**2).sum())))
                by_pixel = float(np.sqrt((apart**2 * 4 * counts / counts.sum()).sum()))
                least["pixel_csd"] = min(least["pixel_csd"], by_pixel)
                for a, b in ((one, other), (other, one)):
                    lit, dimmed = dn[case, a] - dark[case], dn[case, b] - dark[case]
                    scan = np.sqrt(((lit - _DIMMED[:, None] * dimmed) ** 2).sum(axis=1)).min()
                    least["chromatic_csd"] = min(least["chromatic_csd"], float(scan))
                if read is not None:
                    squared = squared_dprime(apart, read.variance[0, case, one], read.variance[0, case, other])
                    least["dprime"] = min(least["dprime"], float(np.sqrt(squared)))
    return least


def assert_refined(made: DesignScene, parts: Iterable[list[View]]) -> None:
    model = SceneModel(made.setup)
    states = STATES if made.setup.scene.noise is not None else ()
    found = evaluate(model, made.curves, states)
    scanned = [least_of(model.at(views), made.curves) for views in parts]
    for name in scanned[0]:
        if f"{name}_yellow_red" in found:
            least = min(of_part[name] for of_part in scanned)
            assert found[f"{name}_yellow_red"][0] <= least * (1 + 1e-3), name


@pytest.mark.parametrize("readout", ["mean", "center"])
@pytest.mark.parametrize("cfa", ["RYNCy", "RGGB"])
def test_no_phase_of_hundreds_is_worse(cfa: str, readout: str) -> None:
    at = {"target": target(220, 60, phase_px="any", readout=readout), "optics": F2, "noise": True}
    made = scene("any", cfa, at, DARK | {"crosstalk": 0.02})
    model, rng = SceneModel(made.setup), np.random.default_rng(7)
    places = rng.uniform(0, 2, size=(300, 2))
    phases = phases_at(made.setup, places)[0]
    assert_refined(made, [[*model.views(phases)]])


def test_no_field_position_of_hundreds_is_worse() -> None:
    at = {"field": {"cra_max_deg": 20.0, "places": "any"}, "optics": F2, "noise": True}
    made = scene("field", "RYNCy", at, DARK, index=1.8)
    model = SceneModel(made.setup)
    heights = np.random.default_rng(3).uniform(0, 1, 200).tolist()
    assert_refined(made, [[*model.views(heights=[height])] for height in heights])
