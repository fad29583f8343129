"""Run a study over the cores or a cluster and keep what it found."""

from .estimate import estimate, estimate_lines
from .folders import output_folder
from .planning import with_plans
from .run import Wishes, run_study
from .status import status_lines
from .workers import BACKENDS

__all__ = [
    "BACKENDS",
    "Wishes",
    "estimate",
    "estimate_lines",
    "output_folder",
    "run_study",
    "status_lines",
    "with_plans",
]
