# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---
# %% [markdown]
# # Your sensor, your lights
# Curves come from files, tables or arrays. Here we make up a sensor and two kinds of lamps, write them as instruments do,
# and read them back.

# %%
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

import sweep

folder = Path(tempfile.mkdtemp())
wavelength_nm = np.arange(380, 781, 5)


def bell(center_nm, width_nm):
    return np.exp(-(((wavelength_nm - center_nm) / width_nm) ** 2))


# %% [markdown]
# A vendor's sheet: percent, with a decimal comma and semicolons. What is not clear in a file is refused with a line that
# says why; `read_curves` shows what was read.

# %%
qe = pd.DataFrame({"nm": wavelength_nm, "R": 55 * bell(610, 60), "G": 60 * bell(535, 55), "B": 50 * bell(455, 45)})
qe["C"] = 80 * bell(560, 190)
sheet = folder / "sensor.csv"
qe.to_csv(sheet, sep=";", decimal=",", index=False)
curves = sweep.read_curves(sheet)
print(curves.iloc[::20].round(3))

# %% [markdown]
# Lamps: two yellow and two red LEDs. Their height does not matter, only their shape does.

# %%
lamps = {"amber_1": (589, 9), "amber_2": (592, 10), "ruby_1": (622, 10), "ruby_2": (634, 11)}
leds = pd.DataFrame({name: bell(*of) for name, of in lamps.items()}, index=wavelength_nm)
lights = sweep.lights(leds, types={"yellow": ["amber_1", "amber_2"], "red": ["ruby_1", "ruby_2"]})

# %% [markdown]
# `C` is the curve of a pixel without a filter: the light of a whole CFA is compared with it. A table of QE between 0 and 1
# does as well as the file: `sweep.sensor(curves / 100, clear="C")`.

# %%
sensor = sweep.sensor(sheet, clear="C")
study = sweep.make_study("mine", sensor=sensor, lights=lights, cfas=["RGGB", "RCCB"])
table = study.evaluate()
print(table.set_index("cfa")[["csd_yellow_red", "cfa_sensitivity"]].round(3))

# %% [markdown]
# The same with a small well and 10 bits; a distance is told in digital numbers, of which there are four times fewer:

# %%
coarse = sweep.make_study(
    "coarse", sensor=sensor, lights=lights, cfas=["RGGB", "RCCB"], pixel=sweep.Pixel(bits=10, well_e=4000)
)
print(coarse.evaluate().set_index("cfa")[["csd_yellow_red"]].round(3))
