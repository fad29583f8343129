"""Write a study file to begin with: for the built-in curves, or for a user's own."""

from .make import new_study

__all__ = ["new_study"]
