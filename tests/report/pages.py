"""Reports in a browser, for tests that look at them."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

BROWSER = next((p for n in ("chromium", "chromium-browser", "google-chrome") if (p := shutil.which(n))), None)
needs_browser = pytest.mark.skipif(BROWSER is None, reason="there is no Chromium on this machine")


@dataclass
class Opened:
    """An open page, and what it said and asked for."""

    page: Any
    errors: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def number_of_points(self) -> int:
        count = "document.getElementById('pareto').data.reduce((n, t) => n + (t.customdata ? t.x.length : 0), 0)"
        return int(self.page.evaluate(count))

    def point_at(self, trace: str) -> tuple[float, float, int]:
        """Place on the page of a trace's first point, and its row in the page's data."""
        found = self.page.evaluate(
            """(name) => {
                const box = document.getElementById('pareto') || document.getElementById('cfas');
                box.scrollIntoView();
                const layout = box._fullLayout, place = box.getBoundingClientRect();
                const trace = box.data.find((t) => t.name.startsWith(name));
                return [place.left + layout._size.l + layout.xaxis.d2p(trace.x[0]),
                        place.top + layout._size.t + layout.yaxis.d2p(trace.y[0]), trace.customdata[0]];
            }""",
            trace,
        )
        return float(found[0]), float(found[1]), int(found[2])

    def details(self) -> dict[str, str]:
        """What the page says of the chosen design."""
        pairs = self.page.eval_on_selector_all(
            "#details dl div", "(all) => all.map((d) => [d.children[0].textContent, d.children[1].textContent])"
        )
        return dict(pairs)


def open_report(browser: Any, folder: Path) -> Opened:
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    seen = Opened(page)
    page.on("console", lambda m: seen.errors.append(m.text) if m.type == "error" else None)
    page.on("pageerror", lambda error: seen.errors.append(str(error)))
    page.on("dialog", lambda dialog: seen.errors.append(f"dialog {dialog.message}") or dialog.dismiss())
    page.on("request", lambda request: seen.requests.append(request.url))
    page.goto((folder / "report.html").as_uri())
    page.wait_for_selector("body[data-ready-ms]")
    page.evaluate("document.querySelectorAll('details.section').forEach((box) => { box.open = true; })")
    if page.locator("#pareto").count():
        page.evaluate("document.getElementById('pareto').scrollIntoView()")
        page.wait_for_function("document.getElementById('pareto').data")
    return seen


def through(seen: Opened) -> None:
    """Scroll through the whole page, so that everything is drawn."""
    height = seen.page.evaluate("document.documentElement.scrollHeight")
    for top in range(0, height, 700):
        seen.page.evaluate(f"window.scrollTo(0, {top})")
        seen.page.wait_for_timeout(60)
    seen.page.evaluate("window.scrollTo(0, 0)")
