# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---
# %% [markdown]
# # Images out, boxes back
# With which CFA does a detector find more lamps? Streets are exported as pictures with boxes in COCO's format; a detector
# of thirty lines learns from them and answers as any other would: with a JSON file of COCO results.
#
# Open this file as a notebook with jupytext or in an editor that knows `# %%` cells, or run it: `python round_trip.py`.

# %%
import json
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image
from scipy import ndimage

import sweep

folder = Path(tempfile.mkdtemp())
study = sweep.make_study(
    "streets",
    wavelengths={"step_nm": 20},
    pixel=sweep.Pixel(read_noise_e=2, offset_dn=168, prnu=0.01),
    cfas=["RGGB", "RYYCy"],
    vision={
        "fov_deg": 60,
        "distances_m": [75, 150],
        "crop_px": 48,
        "levels": {
            "dusk": {"illuminance_lx": 100, "light": "LED street light", "exposure_s": 1e-4},
            "night": {"illuminance_lx": 10, "light": "sodium street light", "exposure_s": 1e-4},
        },
        "intensities_cd": [45, 200],
        "seeds": 2,
        "train_images": 50,
        "test_images": 20,
        "prototypes": False,
        "street": {"columns": 4, "rows": 2, "heads": 2, "brake_lamps": 1, "street_lamps": 1, "test_images": 60},
    },
)
run = study.run(folder)
exported = sweep.export_images(run.folder, folder / "pictures", format="coco", form="isp", split=["train", "test"])
print(exported)

# %% [markdown]
# Each CFA has a folder of its own with `images/train`, `images/test` and `annotations`. The detector: blobs above a
# threshold, and the color of each by the nearest mean of the training lamps, or of what is no lamp.


# %%
def blobs(picture):
    """Boxes of bright blobs, and the mean color of each as shares of its light."""
    light = picture.astype(float)
    around = np.median(light, axis=(0, 1))
    labels, _ = ndimage.label((light - around).max(axis=2) > 60)
    for rows, columns in ndimage.find_objects(labels):
        color = (light[rows, columns] - around).clip(0).sum(axis=(0, 1)) + 1.0
        yield (columns.start, rows.start, columns.stop - columns.start, rows.stop - rows.start), color / color.sum()


def category_at(box, truth):
    """The category of the annotated lamp in which the middle of a box lies, or 0."""
    x, y = box[0] + box[2] / 2, box[1] + box[3] / 2
    inside = [
        one for one in truth if 0 <= x - one["bbox"][0] <= one["bbox"][2] and 0 <= y - one["bbox"][1] <= one["bbox"][3]
    ]
    return inside[0]["category_id"] if inside else 0


answers = []
for cfa in sorted((folder / "pictures").glob("*/annotations")):
    learned = {}
    for split in ("train", "test"):
        known = json.loads((cfa / f"instances_{split}.json").read_text())
        lamps = {one["id"] for one in known["categories"] if one["name"].endswith("lamp")}
        for image in known["images"]:
            picture = np.asarray(Image.open(cfa.parent / "images" / split / image["file_name"]))
            truth = [
                one for one in known["annotations"] if one["image_id"] == image["id"] and one["category_id"] in lamps
            ]
            for box, color in blobs(picture):
                if split == "train":
                    learned.setdefault(category_at(box, truth), []).append(color)
                else:
                    away = {
                        number: np.linalg.norm(np.mean(colors, axis=0) - color) for number, colors in learned.items()
                    }
                    best = min(away, key=away.get)
                    if best:
                        answers.append(
                            {"image_id": image["id"], "category_id": best, "bbox": box, "score": 1 - away[best]}
                        )

# %% [markdown]
# Its answers, of both CFAs in one file, are read as COCO results. A box that is blurred wider than the lens overlaps it by
# less than a half: average precision is that of boxes.

# %%
(folder / "blobs.json").write_text(json.dumps(answers))
print(sweep.score(run.folder, [folder / "blobs.json"]))

# %% [markdown]
# And the separation of the two CFAs:

# %%
print(run.table.set_index("name")["csd_yellow_red"].round(1))
