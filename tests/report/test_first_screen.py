"""What a reader sees without scrolling, and each figure that a report promises, in a browser."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from ..conftest import FinishedFolder
from .pages import needs_browser

pytestmark = needs_browser

SCREENS = [
    ("stopband", 1440),
    pytest.param("stopband", 400, marks=pytest.mark.slow),
    *(
        pytest.param(name, width, marks=pytest.mark.slow)
        for width in (400, 1440)
        for name in ("noise", "distance", "dual", "fog", "night", "robust", "angle")
    ),
]


def box(page: Any, selector: str) -> dict[str, float]:
    found = page.locator(selector).first.bounding_box()
    assert found is not None, selector
    return dict(found)


def apart(page: Any, selector: str) -> bool:
    """Whether no two of some elements overlap."""
    boxes = page.evaluate(
        "(all) => [...document.querySelectorAll(all)].map((e) => e.getBoundingClientRect())"
        ".map((b) => [b.left, b.top, b.right, b.bottom])",
        selector,
    )
    assert boxes
    pairs = combinations(boxes, 2)
    return not any(a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3] for a, b in pairs)


def speaks_plainly(page: Any) -> None:
    """Answer and numbers have no name of a column, no sign for a bound, and each number a comparison."""
    said = " ".join(page.locator(".answer, .numbers").all_inner_texts())
    assert not re.search("[<>]=|_per_nm|csd_", said)
    compared = page.locator(".numbers > div small").all_inner_texts()
    assert len(compared) == page.locator(".numbers b").count()
    assert all(any(letter.isdigit() for letter in text) for text in compared)
    terms = page.inner_text(".terms")
    assert "the distance of the two nearest lights" in terms or "the smallest distance between the reading of" in terms


def fits(page: Any, width: int) -> None:
    """Answer, three numbers, if it is of one design, and the first plot lie on the screen; nothing is wider than it."""
    page.evaluate("window.scrollTo(0, 0)")
    first = page.locator(".first .plot").first.get_attribute("id")
    page.wait_for_function("(id) => document.getElementById(id).data", arg=first)
    assert page.evaluate("document.documentElement.scrollWidth") == width
    assert page.locator(".numbers b").count() == (3 if first == "cfas" else 0)
    assert box(page, ".answer")["y"] < box(page, f"#{first}")["y"]
    for value in page.locator(".numbers b").all():
        shown = value.bounding_box()
        clipped = value.evaluate("(e) => e.scrollWidth > e.clientWidth")
        assert not clipped
        assert shown["x"] + shown["width"] <= width
    if width == 1440:
        plot = box(page, f"#{first}")
        assert plot["y"] + plot["height"] <= 900


@pytest.mark.parametrize(("name", "width"), SCREENS)
def test_the_answer_three_numbers_and_the_plot_are_on_one_screen(
    finished: FinishedFolder, standing: Any, name: str, width: int
) -> None:
    page = standing(finished(name), width).page
    fits(page, width)
    speaks_plainly(page)
    assert apart(page, "#cfas .annotation")


def test_the_first_plot_has_every_cfa_at_its_light(finished: FinishedFolder, standing: Any) -> None:
    folder = finished("stopband")
    seen, table = standing(folder), pd.read_parquet(folder / "results.parquet")
    traces = seen.page.evaluate(
        "document.getElementById('cfas').data.map((t) => [t.name, Array.from(t.x), Array.from(t.y)])"
    )
    shown = {name: (np.array(x), np.array(y)) for name, x, y in traces}
    front = pd.read_parquet(folder / "front.parquet")
    kinds = {"plain CFAs": "reference", "named designs": "design", "best of the search": "search"}
    for name, kind in kinds.items():
        rows = table[table["kind"] == kind]
        np.testing.assert_allclose(shown[name][0], rows["cfa_sensitivity"], rtol=1e-6)
        np.testing.assert_allclose(shown[name][1], rows["csd_yellow_red"], rtol=1e-6)
    pareto = pd.read_parquet(folder / "pareto.parquet")
    swept = pareto[(pareto["kind"] == "sweep") & pareto["feasible"]]
    assert len(shown["swept front"][0]) == len(swept)
    bounded = front.dropna(subset=["limit"])
    np.testing.assert_allclose(shown["upper bound for N of RYNCy, unquantized"][0], bounded["cfa_sensitivity_min"])
    np.testing.assert_allclose(shown["upper bound for N of RYNCy, unquantized"][1], bounded["limit"])
    modes = seen.page.evaluate("document.getElementById('cfas').data.filter((t) => t.name === 'found by the search')")
    assert [mode["mode"] for mode in modes] == ["markers"]  # between its levels nothing is found


@pytest.mark.slow
def test_a_printed_report_has_every_figure(finished: FinishedFolder, opened: Any, tmp_path: Path) -> None:
    seen = opened(finished("stopband"))
    seen.page.pdf(path=tmp_path / "report.pdf", prefer_css_page_size=True)
    empty = seen.page.evaluate(
        "[...document.querySelectorAll('.plot')].filter((e) => !e.hidden && !e.data).map((e) => e.id)"
    )
    assert empty == []
    assert (tmp_path / "report.pdf").stat().st_size > 100_000
