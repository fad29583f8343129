"""Quantum efficiency curves of sensors."""

from .sensors import BUILT_IN_SENSORS, SensorCurves, ar0820_sensor, make_sensor

__all__ = ["BUILT_IN_SENSORS", "SensorCurves", "ar0820_sensor", "make_sensor"]
