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


def open_report(browser: Any, folder: Path) -> Opened:
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    seen = Opened(page)
    page.on("console", lambda m: seen.errors.append(m.text) if m.type == "error" else None)
    page.on("pageerror", lambda error: seen.errors.append(str(error)))
    page.on("dialog", lambda dialog: seen.errors.append(f"dialog {dialog.message}") or dialog.dismiss())
    page.on("request", lambda request: seen.requests.append(request.url))
    page.goto((folder / "report.html").as_uri())
    return seen
