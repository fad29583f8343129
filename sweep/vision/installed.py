"""Check for the libraries of the network, without importing them."""

from __future__ import annotations

from importlib.util import find_spec

from ..base.errors import SweepError, ValidationIssue


def require_network() -> None:
    """Raise SweepError if JAX and Optax are not installed."""
    if any(find_spec(name) is None for name in ("jax", "optax")):
        allowed = "pip install 'cfa-sweep[vision]', or `network: false`"
        raise SweepError(
            ValidationIssue("the network needs JAX and Optax, which are not installed", key="vision", allowed=allowed)
        )
