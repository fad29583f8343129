"""The pictures and answers of the studies: `make gallery` runs every study, and writes what its report says and shows.

Into studies/figures, the tables of README.md and studies/README.md, lists of the guide, and studies/guide/gallery.md.
"""

from __future__ import annotations

import re
import subprocess
import sys
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from sweep.features.regions.page import deep_reds
from sweep.features.sensors.page import report_of_sensors
from sweep.features.vision.page import benchmark_of, ranks_of
from sweep.features.vision.readers import OBSERVER
from sweep.report import read_output
from sweep.report.page import Report, plain, report_of
from sweep.report.panels import png
from sweep.report.run import Run
from sweep.report.tables import PROVEN, Table
from sweep.results.manifest import Manifest

STUDIES = Path(__file__).parent.parent / "studies"

PICTURES = (
    "stopband",
    "surrogates",
    "least_loss",
    "least_loss_by_pixel",
    "tiles",
    "chromatic",
    "freeform",
    "producible",
    "robust",
    "angle",
    "dye",
    "band",
    "dual",
    "rccb",
    "balanced",
    "measured",
    "sensors",
    "cameras",
    "infrared",
    "uncertain",
    "deep_red",
    "paper",
    "scorecard",
    "distance",
    "pixel",
    "exposure",
    "fog",
    "night",
    "hdr",
    "hdr_filter",
    "flicker",
    "noise",
    "vision",
)
"""Studies of which the documents show the first picture of their report."""
README = STUDIES.parent / "README.md"
GALLERY = STUDIES / "guide" / "gallery.md"
ANSWERED = (
    README,
    STUDIES / "README.md",
    STUDIES / "guide" / "11-hdr-and-flicker.md",
    STUDIES / "guide" / "12-sensors.md",
    STUDIES / "guide" / "13-pixel-and-tile.md",
)
"""Documents with the answers of studies."""
ROW = re.compile(r"^\| `(\w+)` \| (.*) \| !\[(.*)\]\(figures/(\w+)\.png\) \| (.*) \|$", re.MULTILINE)


def report_in(folder: Path) -> Report:
    """The report of a run, of one sensor or several."""
    return report_of_sensors(folder) if Manifest(folder).runs else report_of(read_output(folder))


def with_answer(text: str, study: str, answer: str) -> str:
    """A document with the answer of a study in the last cell of its row, or in its item of a list."""
    text = re.sub(
        rf"^(\| `{study}` \|.*\|) [^|]* \|$", lambda row: f"{row[1]} {short(answer)} |", text, flags=re.MULTILINE
    )
    return re.sub(rf"^- `{study}`: .*$", lambda _: f"- `{study}`: {answer}", text, flags=re.MULTILINE)


STRICT, PRICE = "chromatic_pixel_csd_yellow_red", ("light", "low_light_lux_led", "color_delta_e_mean_d65")


def short(answer: str) -> str:
    """The first part of an answer; where its figures come from stands in the gallery."""
    first = re.split(r"; |\. ", answer.removesuffix("."))[0]
    return re.sub(r", the best of this \w+", "", first) + "."


def with_table(text: str, study: str, table: str) -> str:
    """The gallery with the answer and the table of a study."""
    block = re.compile(rf"(<!-- answer: {study} -->\n).*?(<!-- end -->)", re.DOTALL)
    return block.sub(lambda found: f"{found[1]}\n{table}\n\n{found[2]}", text)


SHOWN = {
    "stopband": (("RGGB", "RYYCy", "paper_N4", "best stopband"), ("goal", STRICT, *PRICE)),
    "sensors": ((), ("ratio", "light", "chromatic_pixel_csd")),
}
"""Rows, beside that of the bound, and columns that the README shows of a study; without rows all of them."""


def with_run(text: str, folder: Path) -> str:
    """The README with the answer of a run, its table and its conditions."""
    report = report_in(folder)
    names, keys = SHOWN[report.name]
    table = report.lead.table
    assert table is not None
    rows = {name: row for name, row in table.rows.items() if not names or name in names or name.startswith(PROVEN)}
    few = Table({key: table.columns[key] for key in keys}, rows, table.reference, table.hero, head=table.head)
    lines = [short(report.sentence), "", few.markdown, ""]
    if names:
        run = Run(read_output(folder))
        (reds,) = deep_reds(run)
        assert reds.table is not None
        equal, other = (reds.table.cell(run.hero, key).text for key in ("equal", "any"))
        below = f"falls below {run.reference} from a peak of {equal} on, at any brightness from {other} on"
        lines.append(f"With deeper red LEDs at the same red it {below}, by the LED's shape.")
    held = "; ".join(f"{name}: {words}" for name, words in report.conditions if name != "checked")
    body = "\n".join([*lines, "", f"Holds for {held}."]).replace("\u00a0", " ")
    block = re.compile(rf"(<!-- run: {report.name} -->\n).*?(<!-- end -->)", re.DOTALL)
    return block.sub(lambda found: f"{found[1]}\n{body}\n\n{found[2]}", text)


def with_rank(text: str, folder: Path) -> str:
    """The README with how the CSD ranks designs as the ideal observer does."""
    rank = ranks_of(benchmark_of(read_output(folder)), OBSERVER).between["csd"]
    shown = f"{rank.value:.2f} ({rank.low:.2f} to {rank.high:.2f})"
    return re.sub(r"(<!-- rank: vision -->).*?(<!-- end -->)", rf"\g<1>{shown}\g<2>", text)


def gallery(rows: str, old: str) -> str:
    """Text of the gallery, from the table of `studies/README.md`, with the answers that it has."""
    parts = [
        "# Gallery",
        "",
        "**Question: what does the report of each study say and show?** Its first picture, and its first table. `make gallery` makes all of them anew.",
    ]
    for study, question, caption, picture, _ in ROW.findall(rows):
        known = re.search(rf"<!-- answer: {study} -->.*?<!-- end -->", old, re.DOTALL)
        parts += [
            "",
            f"## {study}",
            "",
            f"{question} `{'make accuracy' if study == 'accuracy' else f'make study NAME={study}'}`",
            "",
            f"![{caption}](../figures/{picture}.png)",
            "",
            known[0] if known else f"<!-- answer: {study} -->\n<!-- end -->",
        ]
    return "\n".join(parts) + "\n"


def copy_picture(report: Report, target: Path) -> None:
    """Draw the first two panels of a report, at most 1,200 pixels wide and in 256 colors, a third of its size."""
    sections = [section for section in (report.lead, *report.sections) if section.panels]
    with Image.open(BytesIO(png(sections[0].panels[:2]))) as picture:
        small = picture.convert("RGB")
        small.thumbnail((1200, 1200), Image.Resampling.LANCZOS)
        small.quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(target, optimize=True)


def main() -> None:
    """Run the studies that are named, or all, and copy their answers and pictures; `--in FOLDER`: where runs are kept."""
    wanted = sys.argv[1:]
    with TemporaryDirectory() as temporary:
        folder = Path(temporary)
        if wanted[:1] == ["--in"]:
            folder, wanted = Path(wanted[1]), wanted[2:]
        for study in wanted or list(PICTURES):
            command = [Path(sys.executable).with_name("sweep"), "run", STUDIES / f"{study}.yaml", "--output", folder]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            report = report_in(folder / study)
            answer = plain(report.sentence)
            for document in ANSWERED:
                document.write_text(with_answer(document.read_text(encoding="utf-8"), study, answer), encoding="utf-8")
            written = gallery((STUDIES / "README.md").read_text(encoding="utf-8"), GALLERY.read_text(encoding="utf-8"))
            GALLERY.write_text(with_table(written, study, report.markdown), encoding="utf-8")
            if study in SHOWN:
                README.write_text(with_run(README.read_text(encoding="utf-8"), folder / study), encoding="utf-8")
            if study == "vision":
                README.write_text(with_rank(README.read_text(encoding="utf-8"), folder / study), encoding="utf-8")
            copy_picture(report, STUDIES / "figures" / f"{study}.png")


if __name__ == "__main__":
    main()
