"""Run a study over the cores or a cluster and keep what it found."""

from ..results.folder import output_folder
from .estimate import estimate, estimate_lines
from .plans import with_plans
from .stop import stop_on_signals
from .whole import Wishes, run_study
from .workers import BACKENDS, usable_backend

__all__ = [
    "BACKENDS",
    "Wishes",
    "estimate",
    "estimate_lines",
    "output_folder",
    "run_study",
    "stop_on_signals",
    "usable_backend",
    "with_plans",
]
