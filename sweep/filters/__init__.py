"""Quantum efficiency curves of sensors."""

from .sensors import BUILT_IN_SENSORS, SensorCurves, make_sensor

__all__ = ["BUILT_IN_SENSORS", "SensorCurves", "make_sensor"]
