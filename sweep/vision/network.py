"""Small convolutional network on planes of raw pixels, trained with JAX; the same for every CFA.

Two layers of 3 x 3 filters (40 and 64 of them, the second with a stride of two) and a dense layer of 128 follow on the
planes; what is known of a scene (distance, light) scales and shifts the first filters and the dense layer. Beside the
state the network learns which lens is lit, the order of the lenses and the sun on them. The order of the sums is fixed:
one seed gives the same numbers on one machine. Where JAX has a GPU, it is taken.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.types import Array, Float, IndexArray, Int

# Before JAX is loaded: workers have one thread each, and sums have one order; workers share a GPU's memory.
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")
os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")

import jax
import jax.numpy as jnp
import optax

_FILTERS = ((40, 1), (64, 2))
_DENSE = 128
_BATCH, _BATCHES = 128, 8
_RATE, _DECAY = 6e-3, 1e-4
_WARM_UP = 0.05
"""Share of the steps in which the rate rises; then it falls along a cosine."""
_BESIDE = 0.2
"""Weight of what is learned beside the state."""
_AT_ONCE = 4096
_OPTIMIZER = optax.chain(optax.scale_by_adam(), optax.add_decayed_weights(_DECAY))
"""AdamW, whose rate is passed to each step."""
_Weights = dict[str, Any]
Inputs = tuple[NDArray[np.float32], NDArray[np.float32]]
"""Planes, [n, rows, columns, planes], and what is known, [n, known]."""


def _start(key: Any, inputs: Inputs, n_outputs: int) -> _Weights:
    """Return He's initial weights."""
    high, wide, planes = inputs[0].shape[1:]
    n_known = inputs[1].shape[1]
    weights: _Weights = {}
    keys = jax.random.split(key, len(_FILTERS) + 3)
    for at, (filters, step) in enumerate(_FILTERS):
        weights[f"filters{at}"] = jax.random.normal(keys[at], (9 * planes, filters)) * math.sqrt(2 / (9 * planes))
        weights[f"bias{at}"] = jnp.zeros(filters)
        planes, high, wide = filters, -(-high // step), -(-wide // step)
    first = _FILTERS[0][0]
    weights["scale"], weights["shift"] = jnp.zeros((n_known, first)), jnp.zeros((n_known, first))
    n_inputs = high * wide * planes
    weights["dense"] = jax.random.normal(keys[-3], (n_inputs, _DENSE)) * math.sqrt(2 / n_inputs)
    weights["dense_bias"] = jnp.zeros(_DENSE)
    weights["known"] = jax.random.normal(keys[-2], (n_known, _DENSE)) * 0.1
    weights["last"] = jax.random.normal(keys[-1], (_DENSE, n_outputs)) * math.sqrt(1 / _DENSE)
    weights["last_bias"] = jnp.zeros(n_outputs)
    return weights


def _filtered(x: Any, filters: Any, bias: Any, step: int) -> Any:
    """Apply 3 x 3 filters as one matrix product, many times faster on a CPU than XLA's own convolution."""
    high, wide = x.shape[1:3]
    padded = jnp.pad(x, ((0, 0), (1, 1), (1, 1), (0, 0)))
    shifts = [padded[:, i : i + high : step, j : j + wide : step] for i in range(3) for j in range(3)]
    return jnp.concatenate(shifts, axis=-1) @ filters + bias


def _outputs(weights: _Weights, x: Any, known: Any) -> Any:
    for at, (_, step) in enumerate(_FILTERS):
        x = _filtered(x, weights[f"filters{at}"], weights[f"bias{at}"], step)
        if at == 0:
            x = x * (1 + (known @ weights["scale"])[:, None, None]) + (known @ weights["shift"])[:, None, None]
        x = jax.nn.relu(x)
    x = x.reshape(len(x), -1) @ weights["dense"] + weights["dense_bias"] + known @ weights["known"]
    return jax.nn.relu(x) @ weights["last"] + weights["last_bias"]


def _loss(weights: _Weights, x: Any, known: Any, y: Any, sizes: tuple[int, ...]) -> Any:
    parts = jnp.split(_outputs(weights, x, known), np.cumsum(sizes)[:-1], axis=1)
    losses = [optax.softmax_cross_entropy_with_integer_labels(part, y[:, at]).mean() for at, part in enumerate(parts)]
    return losses[0] + _BESIDE * sum(losses[1:])


@partial(jax.jit, static_argnames="sizes")
def _steps(held: tuple[_Weights, Any], batches: tuple[Any, ...], sizes: tuple[int, ...]) -> tuple[_Weights, Any]:
    """Take one step for each of a few batches of planes, what is known, targets and rate."""

    def step(held: tuple[_Weights, Any], batch: tuple[Any, ...]) -> tuple[tuple[_Weights, Any], None]:
        x, known, y, rate = batch
        gradient = jax.grad(_loss)(held[0], x, known, y, sizes)
        updates, moved = _OPTIMIZER.update(gradient, held[1], held[0])
        return (optax.apply_updates(held[0], jax.tree.map(lambda u: -rate * u, updates)), moved), None

    return jax.lax.scan(step, held, batches)[0]


_outputs_compiled: Callable[..., Any] = jax.jit(_outputs)


@dataclass(frozen=True)
class Network:
    """Trained network."""

    weights: _Weights
    n_states: int

    def logits(self, planes: NDArray[np.float32], known: NDArray[np.float32]) -> Float[Array, "images states"]:
        """Return the logarithm of the probability of each state, but for a constant of each image."""
        starts = range(0, len(planes), _AT_ONCE)
        parts = [
            _outputs_compiled(self.weights, planes[at : at + _AT_ONCE], known[at : at + _AT_ONCE]) for at in starts
        ]
        return np.concatenate([np.asarray(part, dtype=float) for part in parts])[:, : self.n_states]


def train(
    inputs: Inputs,
    targets: Int[IndexArray, "images targets"],
    sizes: tuple[int, ...],
    epochs: int,
    seed: tuple[int, ...],
) -> Network:
    """Train a network by AdamW, with a rate that falls along a cosine."""
    rng = np.random.default_rng(seed)
    planes, known = inputs
    weights = _start(jax.random.key(int(rng.integers(2**31))), inputs, sum(sizes))
    calls = max(1, math.ceil(len(planes) / (_BATCH * _BATCHES)))
    n_steps = epochs * calls * _BATCHES
    rate = optax.warmup_cosine_decay_schedule(_RATE / 20, _RATE, math.ceil(_WARM_UP * n_steps), n_steps, _RATE / 1000)
    rates = np.asarray(rate(np.arange(n_steps)), dtype=np.float32).reshape(epochs, calls, _BATCHES)
    held = weights, _OPTIMIZER.init(weights)
    numbers = targets.astype(np.int32)
    for epoch in range(epochs):
        order = np.resize(rng.permutation(len(planes)), calls * _BATCH * _BATCHES).reshape(-1, _BATCHES, _BATCH)
        for batch, of_steps in zip(order, rates[epoch], strict=True):
            held = _steps(held, (planes[batch], known[batch], numbers[batch], of_steps), sizes)
    return Network(held[0], sizes[0])
