"""CIELAB and CIEDE2000, smooth enough for derivatives by complex steps."""

from __future__ import annotations

import numpy as np

from ...metrics.complex_step import Smooth, root

_EPSILON, _KAPPA = 216 / 24389, 24389 / 27
"""Constants of CIE 15: where the cube root begins, and the slope of lightness below it."""
_25_7 = 25.0**7


def lab(xyz: Smooth, white: Smooth) -> Smooth:
    """Return CIELAB (CIE 15), linear below the range of the cube root, also below 0."""
    ratio = xyz / white
    bright = ratio.real > _EPSILON
    f = np.where(bright, np.where(bright, ratio, 1.0) ** (1 / 3), (_KAPPA * ratio + 16) / 116)
    x, y, z = f[..., 0], f[..., 1], f[..., 2]
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def lab_slope(ratio: Smooth) -> Smooth:
    """Return the derivative of CIELAB by XYZ relative to white."""
    bright = ratio.real > _EPSILON
    slope = np.where(bright, np.where(bright, ratio, 1.0) ** (-2 / 3) / 3, _KAPPA / 116)
    mixed = np.array([[0.0, 116.0, 0.0], [500.0, -500.0, 0.0], [0.0, 200.0, -200.0]])
    return np.asarray(mixed * slope[..., None, :])


def delta_e(first: Smooth, second: Smooth) -> Smooth:
    """Return the Euclidean distance in CIELAB (1976)."""
    return root(((first - second) ** 2).sum(axis=-1))


def delta_e_2000(first: Smooth, second: Smooth) -> Smooth:
    """Return CIEDE2000 (CIE 142, after Sharma, Wu and Dalal, 2005)."""
    (l_1, a_1, b_1), (l_2, a_2, b_2) = (np.moveaxis(colors, -1, 0) for colors in np.broadcast_arrays(first, second))
    chroma = (root(a_1**2 + b_1**2) + root(a_2**2 + b_2**2)) / 2
    g = (1 - root(chroma**7 / (chroma**7 + _25_7))) / 2
    a_1, a_2 = a_1 * (1 + g), a_2 * (1 + g)
    c_1, c_2 = root(a_1**2 + b_1**2), root(a_2**2 + b_2**2)
    h_1, h_2 = _angle(a_1, b_1), _angle(a_2, b_2)
    gray = (c_1.real * c_2.real) == 0
    turn = h_2 - h_1
    turn = np.where(turn.real > np.pi, turn - 2 * np.pi, np.where(turn.real < -np.pi, turn + 2 * np.pi, turn))
    turn = np.where(gray, 0.0, turn)
    far = np.abs((h_1 - h_2).real) > np.pi
    sum_h = h_1 + h_2
    middle = np.where(far, np.where(sum_h.real < 2 * np.pi, sum_h + 2 * np.pi, sum_h - 2 * np.pi), sum_h) / 2
    middle = np.where(gray, sum_h, middle)
    lightness, chroma = (l_1 + l_2) / 2, (c_1 + c_2) / 2
    t = 1 - 0.17 * np.cos(middle - np.pi / 6) + 0.24 * np.cos(2 * middle)
    t = t + 0.32 * np.cos(3 * middle + np.pi / 30) - 0.20 * np.cos(4 * middle - np.radians(63))
    s_l = 1 + 0.015 * (lightness - 50) ** 2 / (20 + (lightness - 50) ** 2) ** 0.5
    s_c, s_h = 1 + 0.045 * chroma, 1 + 0.015 * chroma * t
    rotation = 2 * root(chroma**7 / (chroma**7 + _25_7))
    rotation = rotation * np.sin(np.radians(60) * np.exp(-(((middle - np.radians(275)) / np.radians(25)) ** 2)))
    d_l, d_c = (l_2 - l_1) / s_l, (c_2 - c_1) / s_c
    d_h = 2 * root(c_1 * c_2) * np.sin(turn / 2) / s_h
    return root(d_l**2 + d_c**2 + d_h**2 - rotation * d_c * d_h)


def _angle(a: Smooth, b: Smooth) -> Smooth:
    """Return the hue angle of (a, b) in 0..2 pi, with its derivative."""
    angle = np.arctan2(b.real, a.real) % (2 * np.pi)
    if not np.iscomplexobj(a):
        return np.asarray(angle)
    square = a.real**2 + b.real**2
    slope = np.divide(a.real * b.imag - b.real * a.imag, square, out=np.zeros_like(square), where=square > 0)
    return np.asarray(angle + 1j * slope)
