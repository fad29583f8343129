"""Run a study over the cores and keep what it found."""

from .run import Progress, run_study

__all__ = ["Progress", "run_study"]
