# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---
# %% [markdown]
# # A first filter
# What does one filter of your own do to the distance between yellow and red traffic lights?
#
# Open this file as a notebook with jupytext or in an editor that knows `# %%` cells, or run it: `python first_filter.py`.

# %%
import numpy as np

import sweep

study = sweep.load_study("stopband")
study

# %% [markdown]
# The study replaces one yellow pixel of the CFA RYYCy by a new channel, N. Our filter is yellow, but lets only a third of
# the light through from 605 to 645 nm.

# %%
yellow = study.curve("Y")
wavelength_nm = yellow.index.to_numpy()
mine = yellow * np.where((wavelength_nm > 605) & (wavelength_nm < 645), 1 / 3, 1.0)
table = study.evaluate(N=mine)
print(table[["csd_yellow_red", "sensitivity", "cfa_sensitivity"]].round(3))

# %% [markdown]
# Units and meanings of the columns come with the table.

# %%
print(table.attrs["units"]["csd_yellow_red"], "|", table.attrs["meanings"]["csd_yellow_red"])

# %% [markdown]
# And beside the CFAs of the study, as they are:

# %%
plain = study.evaluate()
print(plain.set_index("cfa")[["csd_yellow_red", "cfa_sensitivity"]].round(3))

# %% [markdown]
# How good could any filter be that keeps the study's constraints? No filter, of whatever shape, exceeds this:

# %%
limit = study.upper_bound()
print(f"{limit.proven:.1f} DN is the limit; ours reaches {table.csd_yellow_red[0] / limit.proven:.0%} of it")

# %% [markdown]
# Where does the filter stand among the curves of the sensor?

# %%
figure = study.curves.assign(N=mine).plot()
