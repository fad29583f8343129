"""Built-in curves: traffic light data sets, and parts of sensors."""
