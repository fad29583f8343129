"""The documentation: tables as the program prints them, figures that a run reproduces."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from sweep.base.errors import OutputError
from sweep.base.types import in_turn
from sweep.cli.accuracy import measure_accuracy
from sweep.metrics.share import format_share
from sweep.report.parameter_map import map_lines
from sweep.report.price import price_table
from sweep.report.vision_report import vision_parts
from sweep.results.output import read_output
from sweep.run.search import run_search
from sweep.study import load_study

from .commanded import commanded
from .conftest import FEWER, ROOT, STUDIES, FinishedFolder, draw_nothing
from .gallery import ANSWERED, PICTURES, answer_of, with_answer
from .printed import PRINTED, with_printed

README = (ROOT / "README.md").read_text()
FOLDERS = ("outputs", "studies", "sweep", "tests")


def prose(text: str) -> str:
    """The text without code, tables, pictures and headings; a link is its words."""
    text = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    text = re.sub(r"!\[.*?\]\(.*?\)", "", text)
    text = re.sub(r"\[(.*?)\]\(.*?\)", r"\1", text)
    text = re.sub(r"^(\||#).*$", "", text, flags=re.MULTILINE)
    return text.replace("**", "")


@pytest.mark.parametrize("file", list(PRINTED))
def test_printed_parts_are_as_the_program_prints_them(file: str) -> None:
    text = (ROOT / file).read_text()
    assert with_printed(text, PRINTED[file]) == text


def test_every_link_leads_somewhere() -> None:
    for document in (ROOT / "README.md", *(ROOT / name / "README.md" for name in FOLDERS), *STUDIES.glob("guide/*.md")):
        for target, anchor in re.findall(r"\]\(([^)#]*)#?([^)]*)\)", document.read_text()):
            page = document.parent / target if target else document
            assert page.exists(), (document, target)
            assert not anchor or anchor in anchors(page.read_text()), (document, target, anchor)


def anchors(text: str) -> set[str]:
    """Anchors of the headings of a Markdown text, as GitHub names them."""
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


WHOLE = ("fog", "noise", "exposure")
"""Studies that are run with all of their scenarios here."""


@pytest.mark.gallery
@pytest.mark.parametrize(
    "name", [name for name in PICTURES if name in WHOLE or name not in {"vision", "sensors", *FEWER}]
)
def test_an_answer_in_the_documents_is_that_of_its_run(
    finished: FinishedFolder, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if name in WHOLE:
        draw_nothing(monkeypatch)
        code, output, _ = commanded("run", STUDIES / f"{name}.yaml", "--output", tmp_path, "--jobs", 1)
        assert code == 0
    else:
        output = finished(name).with_name(f"{name}.said.txt").read_text()
    for document in ANSWERED:
        text = document.read_text()
        assert with_answer(text, name, answer_of(output)) == text, document


def stopband(finished: FinishedFolder) -> dict[str, pd.Series]:
    """Rows of the finished study by their names."""
    table = pd.read_parquet(finished("stopband") / "results.parquet")
    return {row["name"]: row for _, row in table[table["kind"] != "sweep"].iterrows()}


FIGURES: dict[str, Callable[[dict[str, pd.Series]], str]] = {
    "234 DN at 0.591": lambda r: (
        f"{r['best stopband']['csd_yellow_red']:.0f} DN at {r['best stopband']['cfa_sensitivity']:.3f}"
    ),
    "1.68 times the separation of RGGB (139 DN)": lambda r: (
        f"{r['best stopband']['csd_yellow_red'] / r['RGGB']['csd_yellow_red']:.2f} times the separation of RGGB "
        f"({r['RGGB']['csd_yellow_red']:.0f} DN)"
    ),
    "1.68 times its light (0.352)": lambda r: (
        f"{r['best stopband']['cfa_sensitivity'] / r['RGGB']['cfa_sensitivity']:.2f} times its light "
        f"({r['RGGB']['cfa_sensitivity']:.3f})"
    ),
    "31 DN at 0.610": lambda r: f"{r['RYYCy']['csd_yellow_red']:.0f} DN at {r['RYYCy']['cfa_sensitivity']:.3f}",
    "90 % of its sensitivity": lambda r: f"{100 * r['best stopband']['sensitivity']:.0f} % of its sensitivity",
    "at most 0.06 per nm": lambda r: f"at most {r['best stopband']['slope_per_nm']:.2f} per nm",
    "is 274.3 DN before quantization": (
        lambda r: f"is {math.ceil(10 * r['best stopband']['limit']) / 10} DN before quantization"
    ),
}
"""Figures of the README -> the same from a run of `make study NAME=stopband`."""
FIGURES_AT_AN_ANGLE: dict[str, tuple[str, str]] = {"keeps 182 DN": ("robust to angles", "keeps {:.0f} DN")}
"""Figures of the README -> the filter of `make study NAME=angle` that has them at the worst of all places."""
FIGURES_OF_ACCURACY: dict[str, tuple[str, float]] = {
    "farther than 0.04 DN from `reference`": ("standard", 0.04),
    "it is up to 2 DN": ("fast", 2.0),
}
"""Figures of the README -> preset of `make accuracy`, and its largest error of any CSD, DN, rounded up.

Where a search for a phase ends hangs on the last bits of a sum, and so on the processor: no more, and not nothing.
"""
CHROMATIC = ("RYN4Cy stays below RGGB (122 DN to 138 DN)", "finds 197 DN", "is 226.0 DN")
"""Figures of the README that `test_the_chromatic_figures_of_the_readme_are_those_of_their_command` compares."""
OF_SENSORS = ("On 2 of the 2 sensors", "1.19 to 1.68", "1.45 to 1.68", "0.75 to 0.96", "1.34 to 1.36")
"""Figures of the README that `test_the_figures_of_several_sensors_are_those_of_their_command` compares."""
NO_RESULTS = (
    "Python 3.11",
    "cos^4",
    "EN 12368",
    "RYN4Cy",
    "f/2",
    "2.8 um",
    "one (`fast`) to 1.2 (`standard`) to seven (`reference`)",
    "as one to ten to 35",
)
"""Numbers of the README's prose that are no results."""


def test_every_figure_of_the_readme_has_its_command() -> None:
    text = " ".join(prose(README).split())
    results = (*FIGURES, *FIGURES_AT_AN_ANGLE, *FIGURES_OF_ACCURACY, *CHROMATIC, *OF_SENSORS)
    for known in results:
        assert known in text
    for known in (*results, *NO_RESULTS):
        text = text.replace(known, "")
    assert re.findall(r"\S*\d\S*", text) == []


def test_the_price_in_the_readme_is_that_of_a_run(finished: FinishedFolder) -> None:
    table = price_table(read_output(finished("stopband")))
    printed = [f"| {' | '.join(row)} |" for row in table.astype(str).to_numpy().tolist()]
    assert [line for line in README.splitlines() if line.endswith(("| gain |", "| loss |"))] == printed


@pytest.mark.gallery
def test_the_chromatic_figures_of_the_readme_are_those_of_their_command(finished: FinishedFolder) -> None:
    table = pd.read_parquet(finished("chromatic") / "results.parquet").set_index("name")
    column, limit = table["chromatic_csd_yellow_red"], table["limit"].max()
    text = " ".join(README.split())
    assert f"RYN4Cy stays below RGGB ({column['RYN4Cy']:.0f} DN to {column['RGGB']:.0f} DN)" in text
    assert f"finds {column['best chromatic stopband']:.0f} DN; " in text
    assert f"in that pixel is {math.ceil(10 * limit) / 10} DN." in text


@pytest.mark.parametrize("said", list(FIGURES))
def test_a_figure_of_the_readme_is_that_of_its_command(finished: FinishedFolder, said: str) -> None:
    assert FIGURES[said](stopband(finished)) == said


@pytest.mark.gallery
def test_the_figures_at_an_angle_are_those_of_their_command(finished: FinishedFolder) -> None:
    scene = load_study(STUDIES / "angle.yaml").scenarios["field"]
    assert scene.optics.f_number == 1.6
    assert scene.field is not None
    assert scene.field.cra_max_deg == 20
    table = pd.read_parquet(finished("angle") / "results.parquet")
    worst = table[table["scenario"] == "field"].set_index("name")["csd_yellow_red"]
    assert {said: told.format(worst[name]) for said, (name, told) in FIGURES_AT_AN_ANGLE.items()} == {
        said: said for said in FIGURES_AT_AN_ANGLE
    }


@pytest.mark.gallery
def test_the_figures_of_accuracy_are_those_of_their_command(tmp_path: Path) -> None:
    study = load_study(STUDIES / "accuracy.yaml")
    measure_accuracy(study, tmp_path, lambda *_: None, presets=("fast", "standard"))
    table = pd.read_parquet(tmp_path / "accuracy.parquet")
    assert table["scenario"].nunique() == 8
    errors = table.groupby("preset")["error_dn"].max()
    for preset, most in FIGURES_OF_ACCURACY.values():
        assert most / 100 <= errors[preset] <= most


@pytest.mark.gallery
def test_the_table_of_the_readme_is_that_of_its_command(finished: FinishedFolder) -> None:
    folder = finished("robust")
    rows = pd.read_parquet(folder / "results.parquet").merge(
        pd.read_parquet(folder / "robustness.parquet"), on="design_id"
    )
    rows = rows.set_index("name")
    names = ("RGGB", "RYYCy", "RYN4Cy", "best at f/2", "robust to lamps")
    lines = [line for line in README.splitlines() if line.endswith(" % |")]
    assert len(lines) == len(names)
    cells = pd.read_parquet(folder / "regions.parquet").groupby(["norm", "design_id"])[["separated", "pairs"]].sum()
    told_apart = cells["separated"] / cells["pairs"]
    at_angles = pd.read_parquet(finished("angle") / "results.parquet")
    over_places = at_angles[at_angles["scenario"] == "field"].set_index("name")
    for name in ("best at f/2", "robust to lamps"):  # the same filters in both studies
        for parameter in ("left_nm", "left_width_nm", "right_nm", "right_width_nm"):
            assert rows.loc[name, parameter] == pytest.approx(over_places.loc[name, parameter], abs=0.02)
    for line, name in zip(lines, names, strict=True):
        row = rows.loc[name]
        shares = [told_apart[norm, row["design_id"]] for norm in ("en_12368", "ite")]
        *of_norms, kept = (format_share(share).replace("%", " %") for share in (*shares, row["yield"]))
        assert line.endswith(f"| {' | '.join(of_norms)} |"), name
        values = (
            row["csd_yellow_red"],
            row["worst_csd_yellow_red"],
            over_places.loc[name]["csd_yellow_red"],
        )
        own = f"{' | '.join(f'{value:.0f} DN' for value in values)} | {kept} |"
        assert own in line, name


GUIDE_TO_LAMPS = (STUDIES / "guide" / "06-lamps-angles-tolerances.md").read_text()


def table_below(text: str, head: str) -> dict[str, list[str]]:
    """Cells of the table whose head begins so, by the first cell of each row."""
    lines = text.split(head)[1].split("\n\n", maxsplit=1)[0].splitlines()[2:]
    return {name: cells for name, *cells in ([cell.strip() for cell in line.strip("|").split("|")] for line in lines)}


@pytest.mark.gallery
def test_the_worst_cases_of_the_guide_are_those_of_their_command(finished: FinishedFolder) -> None:
    rows = pd.read_parquet(finished("robust") / "results.parquet").set_index("name")
    cells = table_below(GUIDE_TO_LAMPS, "| | nominal | worst case: temperature |")
    bound = cells.pop("upper bound")
    assert list(cells) == ["RGGB", "RYYCy", "RYN4Cy", "best at f/2", "robust to lamps"]
    for name, shown in cells.items():
        assert shown[::2] == [f"{rows.loc[name, column]:.0f}" for column in ("csd_yellow_red", "worst_csd_yellow_red")]
    assert bound[2] == f"{math.ceil(rows['limit'].max())}"


@pytest.mark.gallery
def test_the_angles_of_the_guide_are_those_of_their_command(finished: FinishedFolder) -> None:
    rows = pd.read_parquet(finished("angle") / "results.parquet").set_index(["name", "scenario"])
    cells = table_below(GUIDE_TO_LAMPS, "| | nothing moves | on axis, f/1.6 |")
    bound = cells.pop("upper bound")
    assert len(cells) == 7
    for name, shown in cells.items():
        scenes = ("f/1.6 cra_deg=0", "field")
        assert shown[1:] == [f"{rows.loc[(name, scene), 'csd_yellow_red']:.0f}" for scene in scenes]
    assert bound[2] == f"{math.ceil(rows['limit'].max())}"


@pytest.mark.gallery
def test_the_figures_of_colorants_are_those_of_their_command(finished: FinishedFolder) -> None:
    """A filter of colorants does not move with the angle, so that the answer, a row in the field, is the same on axis."""
    rows = pd.read_parquet(finished("dye") / "results.parquet").set_index(["name", "scenario"])
    bands = ("best single band", "best two bands", "band for all lamps")
    names = ("RGGB", *bands, "best at f/2 (thin layers)", "robust to lamps (thin layers)")
    text = (STUDIES / "guide" / "10-colorants.md").read_text()
    for shown in names:
        name = shown.removesuffix(" (thin layers)")
        axis = "field" if name == "best two bands" else "center"
        cells = [rows.loc[name, scene][of + "csd_yellow_red"] for of in ("", "worst_") for scene in (axis, "field")]
        assert f"| {shown} | {' | '.join(f'{value:.0f}' for value in cells)} |" in text
        if name in bands:
            assert cells[0] == pytest.approx(cells[1], rel=1e-12)


@pytest.mark.gallery
def test_the_figures_of_single_bands_are_those_of_a_search(finished: FinishedFolder, tmp_path: Path) -> None:
    text = " ".join((STUDIES / "guide" / "10-colorants.md").read_text().split())
    study = (STUDIES / "band.yaml").read_text().split("  map:")[0]
    best: dict[str, list[str]] = {}
    for form in ("wavelength", "wavenumber"):
        for width in (25, 30, 35, 40, 50):
            made = study.replace("fwhm_nm: [20, 80]", f"fwhm_nm: {width}")
            made = made.replace(
                "family: absorption_bands", f"family: absorption_bands\n    options: {{gaussian_in: {form}}}"
            )
            (tmp_path / "band.yaml").write_text(made)
            loaded = load_study(tmp_path / "band.yaml")
            assert loaded.search is not None
            answer = run_search(loaded, loaded.search, in_turn, lambda *_: None)
            best.setdefault(form, []).append(f"{answer.best.objective:.1f}")
    for form, said in (("wavelength", "has {} DN for widths"), ("wavenumber", "it has {} DN.")):
        *first, last = best[form]
        assert said.format(f"{', '.join(first)} and {last}") in text
    lines = " ".join(map_lines(read_output(finished("band"))))
    assert "is of 45 nm FWHM (rounded down), near 638 nm, with an absorbance of 0.38" in lines
    assert "45 nm, near 638 nm with an absorbance of 0.38, to have the 139 DN of RGGB" in text
    color = pd.read_parquet(finished("band") / "results.parquet").set_index("name")["color_delta_e_mean_d65"]
    said = "of {:.1f} for the best band and for the best stopband, {:.1f} for RYYCy, and {:.1f} for RGGB"
    assert said.format(color["best band"], color["RYYCy"], color["RGGB"]) in text
    assert f"{color['best band']:.1f}" == f"{color['best stopband']:.1f}"


def test_the_figures_of_measured_films_are_those_of_a_search(tmp_path: Path) -> None:
    text = " ".join((STUDIES / "guide" / "10-colorants.md").read_text().split())
    study = (STUDIES / "band.yaml").read_text().split("tasks:")[0].replace("catalog: modeled", "catalog: films")
    found = []
    for pair, sensitivity in itertools.product((1, 2), (0.90, 0.85, 0.80)):
        (tmp_path / "films.yaml").write_text(f"""{study}
boxes:
  films: {{cfa: RYNCy, channel: N, base: Y, family: mixture, options: {{at_most: {pair}}}, box: {{absorbance_1: [0, 6]}}}}
constraints: {{sensitivity: {{min: {sensitivity}}}}}
search: {{starts: 1}}
""")
        loaded = load_study(tmp_path / "films.yaml")
        assert loaded.search is not None
        answer = run_search(loaded, loaded.search, in_turn, lambda *_: None)
        assert answer.choice is not None
        assert answer.best.objective >= answer.choice.tried[answer.choice.best].objective * (1 - 1e-9)
        found.append(f"{answer.best.objective:.1f}")
    first, second, third = found[:3]
    assert f"The best single one has {first}, {second} and {third} DN at 90, 85 and 80 % of the sensitivity" in text
    assert found[3:] == found[:3], "no pair has more"


GUIDE_TO_IMAGES = (STUDIES / "guide" / "07-other-tasks-and-images.md").read_text()
ERRORS_OF_IMAGES = table_below(GUIDE_TO_IMAGES, "| | network | ideal observer |")
"""Design -> errors of network and ideal observer, and the difference to RGGB, as the guide has them."""


def tables_of_images(folder: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The report's tables of errors by design, and of rank correlations by predictor."""
    errors, _, ranks, *_ = vision_parts(read_output(folder)).values()
    return errors.set_index("design"), ranks.set_index("predictor")


@pytest.mark.gallery
def test_the_errors_of_the_ideal_observer_are_those_of_their_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """For some CFAs alone: the images of one do not depend on the others."""
    draw_nothing(monkeypatch)
    changes = ("--set", "vision.network=false", "--set", "vision.street=null", "--set", "cfas=[RGGB, RYYCy]")
    changes += ("--set", "designs={}")
    code, folder, said = commanded("run", STUDIES / "vision.yaml", "--output", tmp_path, "--quiet", *changes)
    assert code == 0, said
    observed = dict(tables_of_images(Path(folder.strip()))[0]["error %: ideal observer, lenses shuffled"])
    assert list(observed) == ["RGGB", "RYYCy"]
    assert {design: ERRORS_OF_IMAGES[design][1] for design in observed} == observed


@pytest.mark.gallery
def test_the_errors_of_the_network_are_those_of_their_command() -> None:
    """The command is `make study NAME=vision`, too long for a test; this reads what it left."""
    folder = ROOT / "outputs" / "vision"
    try:
        read_output(folder)
    except OutputError:
        pytest.skip("there is no finished run in outputs/vision: make study NAME=vision")
    if load_study(folder / "study.resolved.yaml").section != load_study(STUDIES / "vision.yaml").section:
        pytest.skip("outputs/vision is of another study: make study NAME=vision")
    errors, ranks = tables_of_images(folder)
    shown = ["error %: network, lenses shuffled", "error %: ideal observer, lenses shuffled", "less that of RGGB %"]
    assert errors[shown].replace("-", "").T.to_dict("list") == ERRORS_OF_IMAGES
    value = errors.map(lambda text: float(text.split()[0]) if " (" in text else math.nan)
    half = value["error %: network, half of the images, lenses shuffled"] - value[shown[0]]
    everywhere, within = (ranks[name].str.partition(" (") for name in ranks)
    csd, dprime, _, observer = within[0]
    low, high = within[2]["CSD"].strip(")").split(" to ")
    images = pd.read_parquet(folder / "vision.parquet").query(
        "order == 'shuffled' and lamps == 'unseen' and distance_m <= 300"
    )
    wrong = images[["network", "observer"]].ne(images["state"], axis=0).groupby(images["name"]).mean()
    excess = wrong["network"] / wrong["observer"]
    misread = pd.read_parquet(folder / "vision.parquet").query(
        "order == 'shuffled' and lamps == 'unseen' and network != state"
    )
    assert 0.7 < (misread["level"] == "day").mean() < 0.8
    assert "Three of four errors of the network are by day; lamps of 10 cd are hardest" in GUIDE_TO_IMAGES
    assert misread["intensity_cd"].value_counts().idxmax() == 10
    streets = list(vision_parts(read_output(folder)).values())[-1].set_index("design")["all levels"]
    mean = streets.str.partition(" ")[0]
    figures = (
        f"rank correlation {csd}, from {low} to {high}",
        f"points the other way ({dprime})",
        f"says nothing ({observer}, from",
        f"the CSD's is {everywhere[0]['CSD']}.",
        f"reads {half.min():.1f} to {half.max():.1f} percent more",
        f"it errs {excess.min():.1f} to {excess.max():.1f} times as often as the observer",
        f"in `vision.yaml`: RGGB {streets['RGGB']}, RCCC {mean['RCCC']}, RCCB {mean['RCCB']}, RYYCy {mean['RYYCy']}, "
        f"RYN4Cy {mean['RYN4Cy']}, best stopband {streets['best stopband']}, robust to lamps {mean['robust to lamps']}.",
    )
    text = " ".join(GUIDE_TO_IMAGES.split())
    assert [figure for figure in figures if figure not in text] == []


@pytest.mark.gallery
def test_the_figures_of_hdr_pixels_are_those_of_their_commands(
    finished: FinishedFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = " ".join((STUDIES / "guide" / "11-hdr-and-flicker.md").read_text().split())
    folder = finished("hdr")
    handovers = pd.read_parquet(folder / "handovers.parquet").query("name == 'best stopband' and signal_type == 'red'")
    at = handovers.set_index(["channel", "capture"])["at"]
    assert (
        f"at {at['R', 2]:.1f} cd in R, at {at['N', 2]:.0f} cd in N of the best stopband, and at {at['Cy', 2]:.0f} cd in Cy"
        in text
    )
    assert f"saturated from {at['R', 3]:.0f}, {at['N', 3]:.0f} and {at['Cy', 3]:,.0f} cd on" in text
    draw_nothing(monkeypatch)
    changed = ("--set", "pixel.captures=staggered", "--quiet")
    # Exit code 5: its check finds a difference.
    _, folder, _ = commanded("run", STUDIES / "flicker.yaml", "--output", tmp_path, *changed)
    seen = pd.read_parquet(Path(folder.strip()) / "results.parquet")["lamp_seen"].min()
    assert f"in as few as {100 * seen:.1f} % of the phases" in text


@pytest.mark.gallery
def test_the_figures_of_several_sensors_are_those_of_their_command(finished: FinishedFolder) -> None:
    folder = finished("sensors")
    rows = pd.read_parquet(folder / "results.parquet").set_index(["sensor", "lights"])
    rggb, cells = rows[rows["name"] == "RGGB"], {}
    guide, readme = (STUDIES / "guide" / "12-sensors.md").read_text(), " ".join(README.split())
    for (name, cfa), some in rows[rows["name"] != "RGGB"].groupby(["name", "cfa"], sort=False):
        ratios = [some[column] / rggb[column].loc[some.index] for column in ("csd_yellow_red", "cfa_sensitivity")]
        spans = [f"{ratio.min():.2f} to {ratio.max():.2f}" for ratio in ratios]
        n_sensors, more = some.index.get_level_values(0).nunique(), int(((ratios[0] > 1) & (ratios[1] > 1)).sum())
        who = f"{name} of {cfa}" if name == "best stopband" else name
        cells[who] = [str(n_sensors), str(len(some)), *spans, f"{more} of {len(some)}"]
    assert table_below(guide, "| | sensors | pairs with lights |") == cells
    yellow, clear = cells["best stopband of RYNCy"], cells["best stopband of RGBN"]
    assert yellow[4] == f"{yellow[1]} of {yellow[1]}"
    assert f"On {yellow[0]} of the {yellow[0]} sensors here that have yellow pixels" in readme
    assert f"{yellow[2]} times RGGB's separation at {yellow[3]} times its light" in readme
    assert f"{clear[2]} times the separation at {clear[3]} times the light" in readme
    for sensor, lights in list(rows.index.unique())[:4]:
        known = pd.read_parquet(folder / f"{sensor}_{lights}" / "uncertainty.parquet")
        best = known[(known["name"] == "best stopband") & (known["quantity"] == "csd_yellow_red")].iloc[0]
        assert best["ratio_5"] > 1
        assert best["light_ratio_5"] > 1
    together = pd.read_parquet(folder / "all_sensors.parquet").query(
        "designed_on == 'all sensors' and space == 'yellow'"
    )
    assert f"keeps {(together['objective'] / together['own_best']).min():.0%}".replace("%", " %") in guide
