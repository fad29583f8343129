"""CSD reached against evaluations: our search beside SciPy, Optuna and pymoo, at equal evaluations, 10 seeds.

Run by `make bench`; writes outputs/bench/search.json and a figure. Every tool sees the same smooth problem: the box of
studies/stopband.yaml, its constraints, one simulation per evaluation. What counts is the best feasible CSD so far.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.optimize import NonlinearConstraint, differential_evolution

from sweep.metrics.bound import FEASIBLE, total_violation
from sweep.metrics.evaluate import designed_quantities
from sweep.metrics.separation import separation
from sweep.metrics.smooth import smooth_response
from sweep.search.problem import starting_points
from sweep.search.solver import search_from
from sweep.search.upper_bound import upper_bound_of
from sweep.study import load_study

ROOT = Path(__file__).parent.parent
SEEDS = range(10)
BUDGET = 600


class Counted:
    """The problem as a black box: every call is logged with its CSD, or 0 where it is not feasible."""

    def __init__(self) -> None:
        study = load_study(ROOT / "studies" / "stopband.yaml")
        assert study.search is not None
        self.problem = study.problem(study.search)
        self.size = self.problem.free.size
        self.log: list[float] = []
        self._seen: dict[bytes, tuple[float, float]] = {}

    def both(self, u: np.ndarray) -> tuple[float, float]:
        """(CSD, violation) at a point of the unit cube; one simulation however often it is asked for in a row."""
        u = np.clip(np.asarray(u, dtype=float), 0, 1)
        key = u.tobytes()
        if key not in self._seen:
            problem = self.problem
            x = problem.from_unit(u)[None]
            curves = problem.family.curves(x)
            first, second = (problem.setup.members[name] for name in problem.pairs["csd_yellow_red"])
            csd = float(separation(smooth_response(problem.setup, curves)[:, 0], first, second)[0])
            own = np.maximum(problem.family.violation(x).max(axis=1), 0) / 100
            amounts = designed_quantities(problem.setup, curves)
            violation = float(total_violation(amounts, problem.constraints, own)[0])
            self._seen = {key: (csd, violation)}
            self.log.append(csd if violation <= FEASIBLE else 0.0)
        return self._seen[key]


def ours(box: Counted, seed: int) -> list[float]:
    found: list[float] = []
    for start, u in enumerate(starting_points(box.problem, 16, seed)):
        run = search_from(box.problem, start, u, "SLSQP", min(125, BUDGET - len(found)), seed)
        found += [e.objective if e.violation <= FEASIBLE else 0.0 for e in run.log]
        if len(found) >= BUDGET:
            break
    return found


def scipy_de(box: Counted, seed: int) -> list[float]:
    constraint = NonlinearConstraint(lambda u: box.both(u)[1], -np.inf, 0.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        differential_evolution(
            lambda u: -box.both(u)[0],
            [(0, 1)] * box.size,
            constraints=constraint,
            maxiter=BUDGET // 40,
            popsize=10,
            seed=seed,
            polish=False,
        )
    return box.log


def optuna_with(sampler_name: str) -> Callable[[Counted, int], list[float]]:
    """Optuna with one of its samplers."""

    def search(box: Counted, seed: int) -> list[float]:
        import optuna

        optuna.logging.set_verbosity(optuna.logging.ERROR)

        def objective(trial: optuna.Trial) -> float:
            u = np.array([trial.suggest_float(f"u{i}", 0, 1) for i in range(box.size)])
            csd, violation = box.both(u)
            trial.set_user_attr("violation", violation)
            return csd

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            kind = getattr(optuna.samplers, sampler_name)
            sampler = kind(seed=seed, constraints_func=lambda t: (t.user_attrs["violation"],))
            optuna.create_study(direction="maximize", sampler=sampler).optimize(objective, n_trials=BUDGET)
        return box.log

    return search


def pymoo_ga(box: Counted, seed: int) -> list[float]:
    from pymoo.algorithms.soo.nonconvex.ga import GA
    from pymoo.core.problem import ElementwiseProblem
    from pymoo.optimize import minimize

    class Filter(ElementwiseProblem):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__(n_var=box.size, n_obj=1, n_ieq_constr=1, xl=0.0, xu=1.0)

        def _evaluate(self, u: np.ndarray, out: dict[str, object], *_: object, **__: object) -> None:
            csd, violation = box.both(u)
            out["F"], out["G"] = -csd, violation

    minimize(Filter(), GA(pop_size=40), ("n_eval", BUDGET), seed=seed, verbose=False)
    return box.log


TOOLS: dict[str, Callable[[Counted, int], list[float]]] = {
    "sweep (SLSQP, epigraph)": ours,
    "SciPy differential evolution": scipy_de,
    "Optuna TPE": optuna_with("TPESampler"),
    "Optuna NSGA-II": optuna_with("NSGAIISampler"),
    "pymoo GA": pymoo_ga,
}


def main() -> None:
    limit = upper_bound_of(Counted().problem)
    traces = {}
    for name, tool in TOOLS.items():
        rows = []
        for seed in SEEDS:
            best = np.maximum.accumulate(np.array(tool(Counted(), seed)[:BUDGET]))
            rows.append(np.pad(best, (0, BUDGET - best.size), mode="edge"))
        traces[name] = np.array(rows)
        median = np.median(traces[name], axis=0)
        steps = ", ".join(f"{n}: {median[n - 1]:.1f}" for n in (50, 100, 200, BUDGET))
        print(f"{name}: median best feasible CSD after evaluations, DN: {steps}", flush=True)
    target = ROOT / "outputs" / "bench"
    target.mkdir(parents=True, exist_ok=True)
    record = {
        "budget": BUDGET,
        "seeds": len(SEEDS),
        "upper_bound": limit.proven,
        "median_dn": {name: np.median(rows, axis=0).tolist() for name, rows in traces.items()},
        "worst_dn": {name: rows.min(axis=0).tolist() for name, rows in traces.items()},
    }
    (target / "search.json").write_text(json.dumps(record) + "\n")
    draw(traces, limit.proven, target / "search.png")
    print(f"Kept in {target.relative_to(ROOT)}/search.json and search.png.")


def draw(traces: dict[str, np.ndarray], limit: float, path: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 4.5), layout="constrained")
    axes = figure.add_subplot()
    for name, rows in traces.items():
        (line,) = axes.plot(range(1, BUDGET + 1), np.median(rows, axis=0), label=name)
        axes.fill_between(range(1, BUDGET + 1), rows.min(axis=0), rows.max(axis=0), color=line.get_color(), alpha=0.12)
    axes.axhline(limit, color="black", linestyle="--", linewidth=1, label="limit of any filter")
    axes.set(xscale="log", xlabel="evaluations", ylabel="best feasible yellow/red CSD / DN")
    axes.set_title(f"Median and range over {len(SEEDS)} seeds")
    axes.legend(fontsize=8)
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    main()
