# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---
# %% [markdown]
# # A family of filters and a metric of your own
# Which Gaussian dip in a yellow filter tells yellow and red lights apart best? The package has no such family, so we write
# one. Only its parameters and its curves are asked for: gradients come from differences. A camera that sees color and not
# brightness asks for another metric, too: the angle between two lights, whose length is their brightness.

# %%
import tempfile
from pathlib import Path

import sweep

folder = Path(tempfile.mkdtemp())
(folder / "my_filters.py").write_text('''\
import numpy as np


class Dip:
    """The base curve with a Gaussian dip: where, how wide, and how deep."""

    below_base = True  # no curve is above the base: the limit of any filter below the base holds for these, too
    parameters = [("center_nm", 560, 680), ("width_nm", 5, 60), ("depth", 0, 1)]

    def __init__(self, wavelength_nm, base, target):
        self.wavelength_nm, self.base = wavelength_nm, base

    def curves(self, x):
        center, width, depth = x.T[:, :, None]
        return self.base * (1 - depth * np.exp(-(((self.wavelength_nm - center) / width) ** 2) / 2))
''')

# %% [markdown]
# A metric is a function of what the camera reads: digital numbers of designs, signals and channels. It gives a number per
# design, or several, of which the worst counts.

# %%
(folder / "my_metrics.py").write_text('''\
import numpy as np


def worst_hue(readings):
    """The angle between each yellow and each red light, degrees."""
    one, other = (readings.of(kind) - readings.pedestal_dn for kind in ("yellow", "red"))
    one, other = (lights / np.linalg.norm(lights, axis=-1, keepdims=True) for lights in (one, other))
    cosine = np.einsum("dac,dbc->dab", one, other).reshape(len(one), -1)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


worst_hue.unit = "deg"
''')

# %% [markdown]
# The study names the class by its file. It sweeps a coarse grid, and searches between its ends.

# %%
(folder / "dip.yaml").write_text("""\
study: dip
sensor: ar0820
lights: tl16
cfas: [RGGB, RYYCy, RYNCy]
sweeps:
  dips:
    cfa: RYNCy
    channel: N
    base: Y
    family: my_filters.py:Dip
    grid:
      center_nm: {min: 590, max: 660, count: 15}
      width_nm: {min: 6, max: 30, count: 9}
      depth: [0.5, 0.75, 1.0]
metrics: [my_metrics.py:worst_hue]
constraints: {sensitivity: {min: 0.9}, worst_hue: {min: 12}}
search: {space: dips, starts: 4, max_evaluations: 400}
""")

# %% [markdown]
# The study runs code of these files, so that it must be allowed; on the command line with `--allow-code`.

# %%
study = sweep.load_study(folder / "dip.yaml", allow_code=True)
run = study.run(folder / "outputs", jobs=1)
print(run.summary)

# %%
best = run.best
print(best[["center_nm", "width_nm", "depth", "csd_yellow_red", "worst_hue", "sensitivity"]])

# %% [markdown]
# The table is an ordinary DataFrame: how does the best distance of each width depend on it?

# %%
swept = run.table.query("kind == 'sweep' and sensitivity >= 0.9")
print(swept.groupby("width_nm").csd_yellow_red.max().round(1))

# %% [markdown]
# Is the design with the widest angle another one? The metric is a column like any other, and could be the `objective`, too.

# %%
widest = swept.loc[swept.worst_hue.idxmax()]
print(widest[["center_nm", "width_nm", "depth", "csd_yellow_red", "worst_hue", "sensitivity"]])
