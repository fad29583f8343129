"""Reports as a person opens them: in a browser without a network, on a desk and on a phone."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from ..conftest import FinishedFolder

BROWSER = next((p for n in ("chromium", "chromium-browser", "google-chrome") if (p := shutil.which(n))), None)
pytestmark = pytest.mark.skipif(BROWSER is None, reason="there is no Chromium on this machine")
NAMES = ["stopband", *(pytest.param(name, marks=pytest.mark.slow) for name in ("noise", "paper", "distance"))]
MOST_WORDS, MOST_HEIGHT, MOST_BYTES = 900, 4_200, 1_500_000


class Opened:
    """An open page, and what it said and asked for."""

    def __init__(self, page: Any, folder: Path) -> None:
        self.page = page
        self.errors: list[str] = []
        self.requests: list[str] = []
        page.on("console", lambda m: self.errors.append(m.text) if m.type == "error" else None)
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("dialog", lambda dialog: self.errors.append(f"dialog {dialog.message}") or dialog.dismiss())
        page.on("request", lambda request: self.requests.append(request.url))
        page.goto((folder / "report.html").as_uri())


@pytest.fixture(scope="module")
def opened() -> Iterator[Callable[[Path], Opened]]:
    """Opens the report of a folder."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        yield lambda folder: Opened(browser.new_page(viewport={"width": 1440, "height": 900}), folder)
        browser.close()


def counted(page: Any) -> tuple[int, int, int]:
    """Words that are seen but those in pictures, pictures, and the height of the page."""
    text = "[...document.querySelectorAll('h1,h2,p,dt,dd,td,th')].filter(e => !e.closest('#explorer')).map(e => e.innerText).join(' ')"
    words = page.evaluate(f"({text}).split(/\\s+/).filter(w => w).length")
    return words, page.locator("figure").count(), page.evaluate("document.documentElement.scrollHeight")


@pytest.mark.parametrize("name", NAMES)
def test_a_report_is_read_in_minutes(finished: FinishedFolder, opened: Callable[[Path], Opened], name: str) -> None:
    seen = opened(finished(name))
    words, figures, height = counted(seen.page)
    assert words <= MOST_WORDS
    assert figures
    assert height <= MOST_HEIGHT
    page = finished(name) / "report.html"
    assert page.stat().st_size <= MOST_BYTES
    assert seen.errors == []
    assert seen.requests == [page.as_uri()]


@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_cut_on_a_phone(finished: FinishedFolder, opened: Callable[[Path], Opened], name: str) -> None:
    seen = opened(finished(name))
    seen.page.set_viewport_size({"width": 400, "height": 800})
    assert seen.page.evaluate("document.documentElement.scrollWidth") <= 400
    small = "[...document.querySelectorAll('figure svg text')].filter(t => t.getClientRects().length)"
    heights = seen.page.evaluate(
        f"{small}.map(t => parseFloat(getComputedStyle(t).fontSize) * Math.hypot(t.getScreenCTM().a, t.getScreenCTM().b))"
    )
    assert min(heights) >= 9.5


def test_the_explorer_links_its_views_and_columns_sort(
    finished: FinishedFolder, opened: Callable[[Path], Opened]
) -> None:
    seen = opened(finished("stopband"))
    page, rows = seen.page, pd.read_parquet(finished("stopband") / "results.parquet")
    page.locator("#explorer tbody tr").nth(3).click()
    cells = page.locator("#explorer tr.on").inner_text().split("\t")
    row = rows[rows["filter_id"] == int(cells[0].removeprefix("filter "))].iloc[0]
    assert float(cells[1]) == pytest.approx(row["csd_yellow_red"], rel=0.006)
    page.locator("table").first.locator("thead tr:last-child th").nth(1).click()
    values = page.locator("table").first.locator("tbody tr td:nth-child(2)").all_inner_texts()
    numbers = [float(text.split()[0]) for text in values]
    assert numbers == sorted(numbers, reverse=True)
    page.locator("tr[data-design='RYYCy']").first.hover()
    assert page.locator("svg .dimmed").count() > 0
    assert seen.errors == []
