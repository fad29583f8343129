"""A browser and open reports."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from .pages import BROWSER, Opened, open_report


@pytest.fixture(scope="package")
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as started:
        found = started.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        yield found
        found.close()


@pytest.fixture
def opened(browser: Any) -> Iterator[Any]:
    """Opens a report for a test that clicks, or wants to see it from its first moment."""
    pages: list[Opened] = []

    def one(folder: Path) -> Opened:
        pages.append(open_report(browser, folder))
        return pages[-1]

    yield one
    for seen in pages:
        seen.page.close()
