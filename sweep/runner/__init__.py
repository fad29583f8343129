"""Run a study over the cores and keep what it found."""

from .run import run_study
from .searching import Progress

__all__ = ["Progress", "run_study"]
