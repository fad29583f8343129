"""Run a study over the cores or a cluster and keep what it found."""

from .estimate import estimate, estimate_lines
from .folders import output_folder
from .planning import with_plans
from .run import Wishes, run_study
from .status import status_lines
from .stopping import stop_on_signals
from .workers import BACKENDS, usable_backend

__all__ = [
    "BACKENDS",
    "Wishes",
    "estimate",
    "estimate_lines",
    "output_folder",
    "run_study",
    "status_lines",
    "stop_on_signals",
    "usable_backend",
    "with_plans",
]
