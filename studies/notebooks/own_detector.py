# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---
# %% [markdown]
# # A detector of your own
# How often does a classifier err behind each CFA, and how far is it from the ideal observer of the same images?
#
# Open this file as a notebook with jupytext or in an editor that knows `# %%` cells, or run it: `python own_detector.py`.
# It needs scikit-learn.

# %%
import tempfile

import numpy as np
import pandas as pd
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

import sweep

study = sweep.make_study(
    "heads",
    wavelengths={"step_nm": 20},
    pixel=sweep.Pixel(read_noise_e=2, offset_dn=168, prnu=0.01),
    cfas=["RGGB", "RCCB"],
    vision={
        "fov_deg": 120,
        "distances_m": [100],
        "levels": {"night": {"illuminance_lx": 10, "light": "sodium street light", "exposure_s": 2e-5}},
        "intensities_cd": [45, 200],
        "seeds": 2,
        "train_images": 1000,
        "test_images": 100,
        "prototypes": False,
    },
)
run = study.run(tempfile.mkdtemp())

# %% [markdown]
# `images` yields raw images with their labels; a row of labels says what an image shows, and where. We take the middle of
# the images, and the root of the light, which makes its noise uniform.


# %%
def inputs(batch):
    middle = batch.images[:, 6:18, 6:18].reshape(len(batch.images), -1)
    return np.sqrt(np.maximum(middle - 168.0, 0))


answers = []
for cfa in ("RGGB", "RCCB"):
    training, test = (list(sweep.images(run, split, [cfa])) for split in ("train", "test"))
    for seed in range(2):  # each has lamps of its own to learn from
        learned = [(inputs(batch), batch.labels["state"]) for batch in training if batch.labels["seed"].iloc[0] == seed]
        classifier = make_pipeline(StandardScaler(), LogisticRegression(max_iter=300, C=0.01))
        classifier.fit(np.concatenate([x for x, _ in learned]), np.concatenate([y for _, y in learned]))
        for batch in test:
            if batch.labels["seed"].iloc[0] == seed:
                shares = pd.DataFrame(classifier.predict_proba(inputs(batch)), columns=classifier.classes_)
                answers.append(shares.assign(image_id=batch.labels["image_id"].to_numpy()))

# %% [markdown]
# Its errors on lamps that it has not seen, less those of the ideal observer of the same images, with 95 % intervals:

# %%
scores = sweep.scores(run, pd.concat(answers))
whole = scores[(scores["distance_m"] == "all") & (scores["level"] == "all")]
shown = ["order", "name", "error", "observer_error", "above_observer", "above_observer_low", "above_observer_high"]
print(whole[shown].round(3).to_string(index=False))

# %% [markdown]
# And the separation of the two CFAs:

# %%
print(run.table.set_index("name")["csd_yellow_red"].round(1))
