"""Curves that a study can name: traffic light data sets, and parts of sensors."""
