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

from sweep.report import read_output
from sweep.report.hold import holds_for
from sweep.report.page import answer_of as answer_of_run
from sweep.report.page import limits_of, sections_of
from sweep.report.sections.deeper_reds import DeeperReds
from sweep.report.sections.price import Price
from sweep.report.sections.vision import Vision
from sweep.report.vision import format_interval, ranks_of
from sweep.vision.readers import OBSERVER

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
ANSWERED = (
    README,
    STUDIES / "README.md",
    STUDIES / "guide" / "11-hdr-and-flicker.md",
    STUDIES / "guide" / "12-sensors.md",
    STUDIES / "guide" / "13-pixel-and-tile.md",
)
"""Documents with the answers of studies."""
ROW = re.compile(r"^\| `(\w+)` \| (.*) \| !\[(.*)\]\(figures/(\w+)\.png\) \| (.*) \|$", re.MULTILINE)


def answer_of(said: str) -> str:
    """The answer that a run prints: what stands before the effects that were left out."""
    lines = said.splitlines()
    ends = ("Left out: ", "Others: ", "RGGB over ", "More of both: ", "Of the best ", "Note: ", "Files: ")
    answer = " ".join(lines[: next((at for at, line in enumerate(lines) if line.startswith(ends)), 1)])
    return re.sub(r" [A-Z][^A-Z]* \.\.\. \(more in the report\)$", "", answer)  # a sentence that is cut


def with_answer(text: str, study: str, answer: str) -> str:
    """A document with the answer of a study in the last cell of its row, or in its item of a list."""
    text = re.sub(rf"^(\| `{study}` \|.*\|) [^|]* \|$", lambda row: f"{row[1]} {answer} |", text, flags=re.MULTILINE)
    return re.sub(rf"^- `{study}`: .*$", lambda _: f"- `{study}`: {answer}", text, flags=re.MULTILINE)


def with_run(text: str, folder: Path) -> str:
    """The README with the answer, limits and price of a run."""
    output = read_output(folder)
    (price,), (reds,) = Price.of(output), DeeperReds.of(output)
    assert price.table is not None
    table = [price.table.head, ["---"] * len(price.table.head), *price.table.rows]
    lines = [
        " ".join(answer_of_run(output)),
        "",
        *(f"- {line}" for line in (*limits_of(output)[:3:2], *reds.answer)),
        "",
    ]
    lines += [f"| {' | '.join(cells)} |" for cells in table]
    lines += ["", price.table.note, "", holds_for(output).partition(" Pixels in")[0]]
    body = "\n".join(lines).replace("\u00a0", " ")
    block = re.compile(rf"(<!-- run: {output.study.study} -->\n).*?(<!-- end -->)", re.DOTALL)
    return block.sub(lambda found: f"{found[1]}\n{body}\n\n{found[2]}", text)


def with_rank(text: str, folder: Path) -> str:
    """The README with how the CSD ranks designs as the ideal observer does."""
    (benchmark,) = (section.benchmark for section in Vision.of(read_output(folder)) if isinstance(section, Vision))
    rank = ranks_of(benchmark, OBSERVER).between["csd"]
    return re.sub(r"(<!-- rank: vision -->).*?(<!-- end -->)", rf"\g<1>{format_interval(rank)}\g<2>", text)


def gallery(rows: str) -> str:
    """Text of the gallery, from the table of `studies/README.md`."""
    parts = [
        "# Gallery",
        "",
        "**Question: what do the reports of the studies look like?** Each picture is of one run. `make gallery` makes all of them anew.",
    ]
    for study, question, caption, picture, finding in ROW.findall(rows):
        command = "make accuracy" if study == "accuracy" else f"make study NAME={study}"
        parts += [
            "",
            f"## {study}",
            "",
            f"{question} `{command}`",
            "",
            f"![{caption}](../figures/{picture}.png)",
            "",
            finding,
        ]
    return "\n".join(parts) + "\n"


def copy_picture(folder: Path, target: Path) -> None:
    """Draw the first picture of a run's report, at most 1,200 pixels wide and in 256 colors, a third of its size."""
    if (folder / "sensors.png").is_file():
        content = (folder / "sensors.png").read_bytes()
    else:
        lead, _ = sections_of(read_output(folder))
        assert lead is not None
        assert lead.picture is not None
        content = lead.picture.files("picture")["picture.png"]
    with Image.open(BytesIO(content)) as picture:
        small = picture.convert("RGB")
        small.thumbnail((1200, 1200), Image.Resampling.LANCZOS)
        small.quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(target, optimize=True)


def main() -> None:
    """Run the studies that are named, or all, and copy their pictures."""
    wanted = sys.argv[1:] or list(PICTURES)
    with TemporaryDirectory() as folder:
        for study in wanted:
            command = [Path(sys.executable).with_name("sweep"), "run", STUDIES / f"{study}.yaml", "--output", folder]
            said = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
            answer = answer_of(said)
            for document in ANSWERED:
                document.write_text(with_answer(document.read_text(encoding="utf-8"), study, answer), encoding="utf-8")
            if study == "stopband":
                README.write_text(with_run(README.read_text(encoding="utf-8"), Path(folder) / study), encoding="utf-8")
            if study == "vision":
                README.write_text(with_rank(README.read_text(encoding="utf-8"), Path(folder) / study), encoding="utf-8")
            copy_picture(Path(folder) / study, STUDIES / "figures" / f"{study}.png")
    text = gallery((STUDIES / "README.md").read_text(encoding="utf-8"))
    (STUDIES / "guide" / "gallery.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
