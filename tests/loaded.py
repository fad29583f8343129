"""What a command loads until its run has a report; see `warm`."""

from importlib import import_module

for name in (
    "matplotlib.backends.backend_agg",
    "matplotlib.backends.backend_svg",
    "scipy.stats",
    "sweep.cli.app",
    "sweep.api.run",
    "sweep.report.page",
    "sweep.runs.sweep",
    "sweep.search.solver",
):
    import_module(name)
