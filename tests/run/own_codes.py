"""A family and metrics of one's own, and studies that name them."""

from __future__ import annotations

from ..build import BASE

STOPBAND = """\
import numpy as np

SPAN = 1 / (1 - 2 * 0.2466364532884666)


class Band:
    below_base = True
    parameters = [("left_nm", 400, 700), ("left_width_nm", 0, 100), ("right_nm", 400, 700), ("right_width_nm", 0, 100)]

    def __init__(self, wavelength_nm, base, target):
        self.wave, self.base, self.change = wavelength_nm, base, target - base

    def edge(self, center, width):
        t = np.clip((self.wave - center[:, None]) / (width[:, None] * SPAN) + 0.5, 0, 1)
        return t**3 * (t * (6 * t - 15) + 10)

    def curves(self, x):
        return self.base + self.change * (self.edge(x[:, 0], x[:, 1]) - self.edge(x[:, 2], x[:, 3]))

    def violation(self, x):
        half = SPAN / 2
        ends = [x[:, 0] + s * half * x[:, 1] - x[:, 2] - s * half * x[:, 3] for s in (-1, 1)]
        return np.stack(ends, axis=1)
"""
BUILT_IN = BASE.replace("min: 0.9", "min: 0.8")
OWN_FAMILY = BUILT_IN.replace("    cfa: RYNCy\n", "    cfa: RYNCy\n    family: filters.py:Band\n")
CODE = """\
import numpy as np


def apart(readings):
    one, other = readings.of("yellow"), readings.of("red")
    return np.linalg.norm(one[:, :, None] - other[:, None], axis=-1).reshape(len(one), -1)


apart.unit, apart.label, apart.digits = "DN", "yellow/red gap", 1


class Spread:
    name, direction = "red_spread", "less"

    def of(self, readings):
        return np.ptp(readings.of("red"), axis=1).max(axis=1)


def below_zero(readings):
    return apart(readings) - 1e4


def only_n(readings):
    return readings.dn[:, :, readings.channels.index("N")].min(axis=1) if "N" in readings.channels else None
"""
PLAIN = BASE.replace("min: 0.9", "min: 0.8").replace("space: edges", "{space: edges, starts: 4, max_evaluations: 800}")
OWN_METRIC = PLAIN.replace("constraints:", "metrics: [mine.py:apart, mine.py:Spread]\nobjective: apart\nconstraints:")
