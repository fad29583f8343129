# %% [markdown]
# A filter of your own: which Gaussian dip in Y, the curve of a yellow pixel, tells yellow from red best?
# %%
from pathlib import Path

import sweep

Path("dip.py").write_text("""\
import numpy as np

class Dip:
    parameters = [("center_nm", 560, 680), ("width_nm", 5, 60), ("depth", 0, 1)]
    below_base = True  # then the upper bound for any filter below Y holds for these, too

    def __init__(self, wavelength_nm, base, target):
        self.wavelength_nm, self.base = wavelength_nm, base

    def curves(self, x):
        center, width, depth = x.T[:, :, None]
        return self.base * (1 - depth * np.exp(-(((self.wavelength_nm - center) / width) ** 2) / 2))
""")
dip = {"cfa": "RYNCy", "channel": "N", "base": "Y", "family": "dip.py:Dip"}
keys = {"boxes": {"dip": dip}, "search": {"starts": 4}, "constraints": {"sensitivity": {"min": 0.9}}}
study = sweep.make_study("dip", cfas=["RGGB", "RYNCy"], allow_code=True, **keys)
print(study.evaluate(center_nm=[620, 630], width_nm=20, depth=1)[["center_nm", "csd_yellow_red", "sensitivity"]])
print(study.run("outputs").summary)
