"""Finished runs side by side."""

from .make import compare_runs

__all__ = ["compare_runs"]
