"""The reports as a person opens them: in a browser without a network, by pointing, clicking and ticking; every figure."""

from __future__ import annotations

import base64
import csv
import io
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sweep.report import make_report

from ..build import output_of
from ..conftest import FinishedFolder, draw_nothing
from .pages import Opened, needs_browser, through
from .shipped import FAST

pytestmark = needs_browser


def ids(seen: Opened) -> list[int]:
    """design_id of every row that the page holds."""
    packed = seen.page.evaluate("JSON.parse(document.getElementById('data').textContent).design_id.bdata")
    return [int(value) for value in np.frombuffer(base64.b64decode(packed), "<u4")]


def agrees(printed: str, value: float) -> bool:
    """Whether a printed number is the value, rounded to the digits that are printed (of a 32-bit float)."""
    digits = len(printed.partition(".")[2])
    return abs(float(printed) - value) <= 0.5 * 10**-digits + abs(value) * 2**-23


@pytest.mark.parametrize("name", [*FAST, *(pytest.param(name, marks=pytest.mark.slow) for name in ("fog", "paper"))])
def test_a_report_opens_without_an_error_or_a_request(finished: FinishedFolder, standing: Any, name: str) -> None:
    seen = standing(finished(name))
    through(seen)
    assert seen.errors == []
    assert seen.requests == [(finished(name) / "report.html").as_uri()]
    assert seen.page.locator("#cfas .plotly").count() == 1


@pytest.mark.parametrize(
    ("name", "trace"),
    [
        ("stopband", "Pareto front"),
        *(pytest.param(name, "named designs", marks=pytest.mark.slow) for name in ("fog", "paper")),
    ],
)
def test_pointing_and_clicking_tell_of_a_design(finished: FinishedFolder, standing: Any, name: str, trace: str) -> None:
    seen = standing(finished(name))
    table = pd.read_parquet(finished(name) / "results.parquet").set_index("design_id")
    x, y, _ = seen.point_at(trace)
    seen.page.mouse.move(x, y)  # in one step: a design on the way would be told, and clicked, first
    seen.page.wait_for_selector("#hover", state="visible")
    seen.page.mouse.click(x, y)
    seen.page.wait_for_function("document.getElementById('curves').data.length > 0")
    # The page opens with a design that is told already, and on the way another one may have been.
    title = "(id) => document.querySelector(id).firstElementChild.textContent"
    seen.page.wait_for_function(f"({title})('#hover') === document.querySelector('#details h3').textContent")
    chosen = table.loc[int(seen.page.get_attribute("#details", "data-design"))]
    pointed, said = seen.page.inner_text("#hover").splitlines(), seen.details()
    for told, text in said.items():
        if not told.endswith("limited by"):
            column = {"CFA sensitivity": "cfa_sensitivity", "slope": "slope_per_nm"}.get(told, told)
            if column.endswith(" CSD"):
                *prefix, pair = column.removesuffix(" CSD").split()
                column = "_".join([*prefix, "csd", pair.replace("/", "_")])
            assert agrees(text, float(chosen[column])), told
    assert {"sensitivity", "yellow/red CSD"} <= set(said)
    assert f"yellow/red CSD: {said['yellow/red CSD']}" in pointed
    names = seen.page.evaluate("document.getElementById('curves').data.map((t) => t.name)")
    assert {pointed[0], "Y", "G"} <= set(names)


def test_the_page_holds_the_limiting_lights_of_every_design(finished: FinishedFolder, standing: Any) -> None:
    folder = finished("stopband")
    limited = pd.read_parquet(folder / "limited_by.parquet").set_index("design_id")
    seen = standing(folder)
    rows = ids(seen)
    assert len(rows) > 5_000
    for pair in ("green_yellow", "green_red", "yellow_red"):
        told = seen.page.evaluate(f"JSON.parse(document.getElementById('data').textContent).limited.csd_{pair}")
        codes = np.frombuffer(base64.b64decode(told["codes"]["bdata"]), f"<{told['codes']['dtype']}")
        assert [told["words"][code] for code in codes] == list(limited.loc[rows, f"limited_by_{pair}"])


def test_the_parallel_plot_leaves_out_infeasible_designs(finished: FinishedFolder, standing: Any) -> None:
    seen = standing(finished("stopband"))
    before = seen.number_of_points()
    seen.page.uncheck("#infeasible")
    after = seen.number_of_points()
    assert 100 < after < before
    feasible = "document.getElementById('pareto').data.some((t) => t.name.startsWith('not feasible'))"
    assert not seen.page.evaluate(feasible)
    seen.page.check("#infeasible")
    assert seen.number_of_points() == before


def test_the_saved_front_has_every_digit(finished: FinishedFolder, standing: Any) -> None:
    folder = finished("stopband")
    seen = standing(folder)
    with seen.page.expect_download() as waiting:
        seen.page.click("#save")
    text = Path(waiting.value.path()).read_text()
    rows = list(csv.DictReader(io.StringIO(text)))
    table = pd.read_parquet(folder / "pareto.parquet").set_index("design_id")
    front = table[table["feasible"] & (table["kind"] == "sweep")]
    assert {int(row["design_id"]) for row in rows} == set(front.index)
    for row in rows:
        for column in ("left_nm", "csd_yellow_red", "sensitivity", "cfa_sensitivity", "slope_per_nm"):
            assert float(row[column]) == front.loc[int(row["design_id"]), column]


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


HOSTILE = """
study: <script>alert(1)</script>
question: "<img src=x onerror=alert(2)> & \\"quotes\\" - ünïcode?"
sensor:
  name: "</script><b>s</b>"
  files: [{file: qe.csv, columns: {R: "r \\"<i>'", G: "gé&amp;", B: "b;--", W: "w</script>"}}]
lights:
  files:
    - file: lights.csv
      quantity: energy
      signals: {green: ["g<u>"], yellow: ["y'\\""], red: ["r<script>alert(3)</script>"]}
cfas: {RGGB: {tile: [[R, G], [G, B]]}, RGBN: {tile: [[R, G], [B, N]]}}
designs:
  "<b onmouseover=alert(4)>named</b>":
    {cfa: RGBN, channel: N, base: W, to: G, at: {left_nm: 600, left_width_nm: 10, right_nm: 650, right_width_nm: 10}}
sweeps:
  s:
    cfa: RGBN
    channel: N
    base: W
    to: G
    grid: {left_nm: [600, 610], left_width_nm: 10, right_nm: [640, 660], right_width_nm: 10}
"""


def write_curves(folder: Path) -> None:
    wave = np.arange(380.0, 781.0, 5.0)

    def bump(center: float, width: float) -> np.ndarray:
        return np.asarray(np.exp(-0.5 * ((wave - center) / width) ** 2))

    def write(name: str, columns: dict[str, np.ndarray]) -> None:
        pd.DataFrame({"wavelength_nm": wave, **columns}).to_csv(folder / name, index=False)

    qe = {
        "r \"<i>'": 0.5 * bump(600, 40),
        "gé&amp;": 0.5 * bump(540, 40),
        "b;--": 0.5 * bump(460, 35),
        "w</script>": 0.8 * bump(560, 120),
    }
    write("qe.csv", qe)
    write("lights.csv", {"g<u>": bump(505, 12), "y'\"": bump(590, 10), "r<script>alert(3)</script>": bump(630, 10)})


@pytest.mark.parametrize("drawn", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_names_come_out_as_text(tmp_path: Path, opened: Any, drawn: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    write_curves(tmp_path)
    output = output_of(tmp_path, HOSTILE)
    if not drawn:
        draw_nothing(monkeypatch)
    make_report(output)
    seen = opened(output.folder)
    through(seen)
    assert seen.errors == []
    assert seen.page.inner_text("h1") == "<script>alert(1)</script>"
    assert "<img src=x onerror=alert(2)>" in seen.page.inner_text("body")
    assert seen.page.locator("img[src=x]").count() == 0
    x, y, _ = seen.point_at("&lt;b")
    seen.page.mouse.click(x, y)
    seen.page.wait_for_function("document.querySelector('#details h3').textContent.startsWith('<b')")
    assert seen.page.inner_text("#details h3") == "<b onmouseover=alert(4)>named</b>"
    titles = seen.page.evaluate("Array.from(document.querySelectorAll('.gtitle')).map((t) => t.textContent)")
    assert any("<b onmouseover=alert(4)>named</b>" in title for title in titles)
    assert seen.errors == []
