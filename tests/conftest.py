"""Shared by the tests."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
STUDIES = ROOT / "studies"
SHARED = ROOT.parent / "shared"

needs_measured = pytest.mark.skipif(
    not (SHARED / "data").is_dir(), reason="the measured curves (../shared/data) are not on this machine"
)
needs_reference = pytest.mark.skipif(
    not (SHARED / "reference").is_dir(), reason="the ISETCam run (../shared/reference) is not on this machine"
)


@pytest.fixture
def sweep_command() -> list[str]:
    return [sys.executable, "-m", "sweep"]
