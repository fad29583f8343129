"""What a file of curves holds, what is wrong with it, and a picture of it."""

from .make import Description, describe

__all__ = ["Description", "describe"]
