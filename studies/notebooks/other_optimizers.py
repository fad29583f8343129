# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---
# %% [markdown]
# # Other optimizers
# How much separation does a stopband give for how much light? The study evaluates the filters; pymoo, then Optuna,
# choose them for two objectives. `pip install pymoo optuna` first. `search: {front: ...}` in a study asks the same.
#
# Open this file as a notebook with jupytext or in an editor that knows `# %%` cells, or run it.

# %%
import numpy as np
import optuna
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

import sweep

study = sweep.load_study("stopband")
low = {"left_nm": 600, "left_width_nm": 5, "right_nm": 630, "right_width_nm": 5}
high = {"left_nm": 630, "left_width_nm": 20, "right_nm": 660, "right_width_nm": 20}
GOALS = ["csd_yellow_red", "sensitivity"]


def goals(parameters):
    """Both objectives of many filters at once; a call with 50 filters takes little longer than with one."""
    return study.evaluate(**parameters)[GOALS]


# %% [markdown]
# pymoo asks for a whole generation; it minimizes, so that both signs change.


# %%
class TwoGoals(Problem):
    def __init__(self):
        super().__init__(n_var=4, n_obj=2, xl=[*low.values()], xu=[*high.values()])

    def _evaluate(self, x, out, *_, **__):
        out["F"] = -goals(dict(zip(low, x.T, strict=True))).to_numpy()


result = minimize(TwoGoals(), NSGA2(pop_size=40), ("n_gen", 20), seed=1)
front = -result.F[np.argsort(result.F[:, 1])]
print("pymoo, the front between sensitivity and csd_yellow_red:")
for csd_dn, sensitivity in front[:: max(1, len(front) // 8)]:
    print(f"  {sensitivity:.3f}  {csd_dn:5.0f} DN")

# %% [markdown]
# Optuna is asked for a generation of trials, and told what they are worth.

# %%
optuna.logging.set_verbosity(optuna.logging.ERROR)
sampler = optuna.samplers.NSGAIISampler(population_size=40, seed=1)
trials = optuna.create_study(directions=["maximize", "maximize"], sampler=sampler)
ranges = {name: optuna.distributions.FloatDistribution(low[name], high[name]) for name in low}
for _generation in range(20):
    asked = [trials.ask(ranges) for _ in range(40)]
    told = goals({name: [trial.params[name] for trial in asked] for name in low})
    for trial, values in zip(asked, told.to_numpy().tolist(), strict=True):
        trials.tell(trial, values)

best = max(trials.best_trials, key=lambda trial: trial.values[0] if trial.values[1] >= 0.9 else 0)
print(f"Optuna, best csd_yellow_red at a sensitivity of 0.9: {best.values[0]:.0f} DN; {best.params}")
