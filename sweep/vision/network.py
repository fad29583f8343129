"""Small convolutional network on raw pixels, trained with JAX on the CPU; the same for every CFA.

Planes by tile position are the input; three layers of 3 x 3 filters (16, 24 and 32 of them, the last two with a stride
of two pixels) and a dense layer of 32 follow. The order of the sums is fixed: one seed gives the same numbers on one
machine.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ..base.types import FloatArray, IndexArray

# Before JAX is loaded: workers have one thread each, and sums have one order.
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")
os.environ.setdefault("JAX_PLATFORMS", "cpu")

import jax
import jax.numpy as jnp
import optax

_FILTERS = ((16, 1), (24, 2), (32, 2))
_DENSE = 32
_BATCH, _BATCHES = 64, 8
_RATE = 2e-3
_PATIENCE = 6
"""Epochs without a smaller loss on the lamps that are held out, after which training ends."""
_Weights = dict[str, Any]
_OPTIMIZER = optax.adam(_RATE)


def _start(key: Any, shape: tuple[int, ...], n_states: int) -> _Weights:
    """Return He's initial weights for planes of a shape, (rows, columns, planes)."""
    high, wide, planes = shape
    weights: _Weights = {}
    keys = jax.random.split(key, len(_FILTERS) + 2)
    for at, (filters, step) in enumerate(_FILTERS):
        weights[f"filters{at}"] = jax.random.normal(keys[at], (9 * planes, filters)) * math.sqrt(2 / (9 * planes))
        weights[f"bias{at}"] = jnp.zeros(filters)
        planes, high, wide = filters, -(-high // step), -(-wide // step)
    inputs = high * wide * planes
    weights["dense"] = jax.random.normal(keys[-2], (inputs, _DENSE)) * math.sqrt(2 / inputs)
    weights["dense_bias"] = jnp.zeros(_DENSE)
    weights["last"] = jax.random.normal(keys[-1], (_DENSE, n_states)) * math.sqrt(1 / _DENSE)
    weights["last_bias"] = jnp.zeros(n_states)
    return weights


def _filtered(x: Any, filters: Any, bias: Any, step: int) -> Any:
    """Apply 3 x 3 filters as one matrix product, many times faster on a CPU than XLA's own convolution."""
    high, wide = x.shape[1:3]
    padded = jnp.pad(x, ((0, 0), (1, 1), (1, 1), (0, 0)))
    shifts = [padded[:, i : i + high : step, j : j + wide : step] for i in range(3) for j in range(3)]
    return jax.nn.relu(jnp.concatenate(shifts, axis=-1) @ filters + bias)


def _logits(weights: _Weights, x: Any) -> Any:
    for at, (_, step) in enumerate(_FILTERS):
        x = _filtered(x, weights[f"filters{at}"], weights[f"bias{at}"], step)
    x = jax.nn.relu(x.reshape(len(x), -1) @ weights["dense"] + weights["dense_bias"])
    return x @ weights["last"] + weights["last_bias"]


def _loss(weights: _Weights, x: Any, y: Any) -> Any:
    return optax.softmax_cross_entropy_with_integer_labels(_logits(weights, x), y).mean()


@jax.jit
def _steps(weights: _Weights, state: Any, x: Any, y: Any) -> tuple[_Weights, Any]:
    """Take one step for each of a few batches."""

    def step(held: tuple[_Weights, Any], batch: tuple[Any, Any]) -> tuple[tuple[_Weights, Any], None]:
        gradient = jax.grad(_loss)(held[0], *batch)
        updates, moved = _OPTIMIZER.update(gradient, held[1], held[0])
        return (optax.apply_updates(held[0], updates), moved), None

    return jax.lax.scan(step, (weights, state), (x, y))[0]


_checked = jax.jit(_loss)
_softmax: Callable[..., Any] = jax.jit(lambda weights, x: jax.nn.softmax(_logits(weights, x)))


@dataclass(frozen=True)
class Network:
    """Trained network.

    Parameters
    ----------
    weights : list
        Weights.
    mean, deviation : float
        Moments of the training values.
    epochs : int
        Passes over the training images.
    """

    weights: _Weights
    mean: float
    deviation: float
    epochs: int

    def probabilities(self, planes: FloatArray) -> FloatArray:
        """Return the probability of each state.

        Parameters
        ----------
        planes : ndarray of shape (n, rows, columns, planes)
            Images.

        Returns
        -------
        ndarray of shape (n, n_states)
            Probabilities.
        """
        probabilities = _softmax(self.weights, _scaled(planes, self.mean, self.deviation))
        values = np.asarray(probabilities, dtype=float)
        return np.asarray(values / values.sum(axis=1, keepdims=True), dtype=float)


def _scaled(planes: FloatArray, mean: float, deviation: float) -> Any:
    return jnp.asarray((planes - mean) / deviation, dtype=jnp.float32)


def train(
    planes: FloatArray,
    states: IndexArray,
    check: tuple[FloatArray, IndexArray],
    n_states: int,
    epochs: int,
    seed: tuple[int, ...],
) -> Network:
    """Train a network; the weights with the smallest loss on the check images are kept.

    Parameters
    ----------
    planes : ndarray of shape (n, rows, columns, planes)
        Training images.
    states : ndarray of int, shape (n,)
        Their states.
    check : tuple of ndarray
        Images and states for early stopping.
    n_states, epochs : int
        Number of states, and of passes at most.
    seed : tuple of int
        Seed.

    Returns
    -------
    Network
        Trained network.
    """
    rng = np.random.default_rng(seed)
    mean, deviation = float(planes.mean()), max(float(planes.std()), 1e-12)
    scale = partial(_scaled, mean=mean, deviation=deviation)
    weights = _start(jax.random.key(int(rng.integers(2**31))), planes.shape[1:], n_states)
    state, at_once = _OPTIMIZER.init(weights), _BATCH * _BATCHES
    x, y = np.asarray(scale(planes)), states.astype(np.int32)
    seen, right = scale(check[0]), jnp.asarray(check[1], dtype=jnp.int32)
    best = Network(weights, mean, deviation, 0)
    least = math.inf
    for epoch in range(1, epochs + 1):
        order = np.resize(rng.permutation(len(x)), math.ceil(len(x) / at_once) * at_once)
        for some in order.reshape(-1, _BATCHES, _BATCH):
            weights, state = _steps(weights, state, x[some], y[some])
        loss = float(_checked(weights, seen, right))
        if loss < least:
            best, least = Network(weights, mean, deviation, epoch), loss
        elif epoch - best.epochs >= _PATIENCE:
            break
    return best
