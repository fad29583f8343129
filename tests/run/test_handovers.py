"""Where captures of a split pixel hand over, by the light that each of them gets."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from sweep.camera.noise.merge import limits_dn
from sweep.study import load_study

from ..build import output_of
from ..conftest import STUDIES


def test_captures_fill_in_proportion_to_their_light(tmp_path: Path) -> None:
    text = (STUDIES / "hdr.yaml").read_text()
    scenarios = text[text.index("    noise: true") : text.index("cfas:")]
    text = text.replace(scenarios, "    each: {intensity_cd: [1, 100, 10000, 1000000]}\n\n")
    text = text.replace("[RGGB, RCCB, RCCC, RYYCy, RYNCy]", "[RGGB]")
    text = text[: text.index("designs:")] + "objective: csd_yellow_red\n"
    table = output_of(tmp_path, text).tables["handovers.parquet"]
    assert table is not None
    study = load_study(STUDIES / "hdr.yaml")
    pixel = study.setup(study.spaces[0], next(iter(study.scenarios))).camera.pixel
    assert sorted({capture.light for capture in pixel.captures})[0] == 0.01
    seen = 0
    for (channel, _), rows in table.groupby(["channel", "signal_type"]):
        per_light = []
        for capture, read, limit, at in zip(pixel.captures, pixel.read_as, limits_dn(pixel), rows["at"], strict=True):
            full_e = read.saturation_e if limit is None else (limit - read.offset_dn) / read.dn_per_e
            if math.isfinite(at):
                per_light.append(at * capture.light * capture.qe_factor.get(str(channel), 1.0) / full_e)
        seen += len(per_light) > 1
        assert per_light == pytest.approx(per_light[:1] * len(per_light), rel=1e-5)
    assert seen >= 3
