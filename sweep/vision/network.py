"""Dense networks on the pixels of a crop, one for each distance and light level, trained with JAX.

They are the same for every CFA: two hidden layers of 128 and 64 values with ReLU; background and order of the lenses
shift the first. The networks of all distances of a level are trained at once, as one product of matrices. The order of
the sums is fixed: one seed gives the same numbers on one machine. Where JAX has a GPU, it is taken.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.types import Array, Float

# Before JAX is loaded: workers have one thread each, and sums have one order; workers share a GPU's memory.
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")
os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")

import jax
import jax.numpy as jnp
import optax

_HIDDEN = (128, 64)
STEPS = 8
"""Steps of one call."""
_RATE, _DECAY, _SECOND = 6e-3, 1e-4, 0.99
_WARM_UP = 0.05
"""Share of the steps in which the rate rises; then it falls along a cosine."""
_OPTIMIZER = optax.chain(optax.scale_by_adam(b2=_SECOND), optax.add_decayed_weights(_DECAY))
"""AdamW, whose rate is passed to each step."""
_Weights = dict[str, Any]


class Examples(NamedTuple):
    """Images of all distances of one level, for some steps.

    `known`: zeros and ones of background and order.
    """

    crops: Float[Array, "steps distances images inputs"] | NDArray[np.float32]
    known: NDArray[np.float32]
    state: NDArray[np.int32]


def _start(key: Any, distances: int, inputs: int, known: int, states: int) -> _Weights:
    """Return He's initial weights of the networks of a level."""
    sizes, weights = (inputs, *_HIDDEN, states), dict[str, Any]()
    keys = jax.random.split(key, len(sizes))
    for at, (before, after) in enumerate(pairwise(sizes)):
        weights[f"dense{at}"] = jax.random.normal(keys[at], (distances, before, after)) * math.sqrt(2 / before)
        weights[f"bias{at}"] = jnp.zeros((distances, 1, after))
    weights["known"] = jax.random.normal(keys[-1], (distances, known, _HIDDEN[0])) * 0.1
    return weights


def _logits(weights: _Weights, crops: Any, known: Any, relu: Callable[[Any], Any]) -> Any:
    x = relu(crops @ weights["dense0"] + weights["bias0"] + known @ weights["known"])
    for at in range(1, len(_HIDDEN)):
        x = relu(x @ weights[f"dense{at}"] + weights[f"bias{at}"])
    return x @ weights[f"dense{len(_HIDDEN)}"] + weights[f"bias{len(_HIDDEN)}"]


def _loss(weights: list[_Weights], levels: Sequence[Examples]) -> Any:
    """Return the sum over distances and levels: the networks do not share anything."""
    parts = (
        optax.softmax_cross_entropy_with_integer_labels(_logits(own, at.crops, at.known, jax.nn.relu), at.state)
        .mean(axis=1)
        .sum()
        for own, at in zip(weights, levels, strict=True)
    )
    return sum(parts)


@jax.jit
def _steps(held: tuple[list[_Weights], Any], batches: tuple[list[Examples], Any]) -> tuple[list[_Weights], Any]:
    """Take one step for each of a few batches and rates."""

    def step(held: tuple[list[_Weights], Any], batch: tuple[list[Examples], Any]) -> tuple[Any, None]:
        levels, rate = batch
        gradient = jax.grad(_loss)(held[0], levels)
        updates, moved = _OPTIMIZER.update(gradient, held[1], held[0])
        return (optax.apply_updates(held[0], jax.tree.map(lambda u: -rate * u, updates)), moved), None

    return jax.lax.scan(step, held, batches)[0]


def train(images: Callable[[int], list[Examples]], n_states: int, calls: int, seed: tuple[int, ...]) -> list[_Weights]:
    """Train the networks of all levels by AdamW, with a rate that falls along a cosine.

    `images`: new examples of each level, for a number of steps.
    """
    n_steps = calls * STEPS
    step = (np.arange(n_steps) + 1) / n_steps
    falling = 0.5 * (1 + np.cos(math.pi * (step - _WARM_UP) / (1 - _WARM_UP)))
    rates = (_RATE * np.where(step < _WARM_UP, step / _WARM_UP, falling)).astype(np.float32).reshape(calls, STEPS)
    key = jax.random.key(int(np.random.default_rng(seed).integers(2**31)))
    held: Any = None
    for of_steps in rates:
        levels = images(STEPS)
        if held is None:
            keys = jax.random.split(key, len(levels))
            start = [
                _start(k, at.crops.shape[1], at.crops.shape[-1], at.known.shape[-1], n_states)
                for k, at in zip(keys, levels, strict=True)
            ]
            held = start, _OPTIMIZER.init(start)
        held = _steps(held, (levels, of_steps))
    weights: list[_Weights] = held[0]
    return weights


def logits(
    weights: _Weights, distance: int, crops: NDArray[np.float32], known: NDArray[np.float32]
) -> Float[Array, "images states"]:
    """Return the logarithm of the probability of each state, but for a constant of each image.

    By NumPy: JAX would compile anew for each number of images.
    """
    own = {name: np.asarray(part)[distance] for name, part in weights.items()}
    return np.asarray(_logits(own, crops, known, lambda x: np.maximum(x, 0.0)), dtype=float)
