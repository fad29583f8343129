"""Run a study over the cores and keep what it found."""

from .planning import with_plans
from .run import run_study
from .searching import Progress

__all__ = ["Progress", "run_study", "with_plans"]
