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

    def one(folder: Path, width: int = 1280) -> Opened:
        pages.append(open_report(browser, folder, width))
        return pages[-1]

    yield one
    for seen in pages:
        seen.page.close()


MOST_STANDING = 4
"""Pages that stay open at once: a browser has few places for plots drawn by its graphics."""


@pytest.fixture(scope="package")
def standing(browser: Any) -> Iterator[Any]:
    """A report that is opened once for many tests: at 1440 px for those that only look, or leave all as it was."""
    pages: dict[tuple[Path, int], Opened] = {}

    def one(folder: Path, width: int = 1440) -> Opened:
        seen = pages.pop((folder, width), None) or open_report(browser, folder, width)
        pages[folder, width] = seen  # behind those that nobody looked at since
        if len(pages) > MOST_STANDING:
            pages.pop(next(iter(pages))).page.close()
        return seen

    yield one
    for seen in pages.values():
        seen.page.close()
