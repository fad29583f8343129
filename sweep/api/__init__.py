"""Python API: studies and runs as objects, exported by `sweep/__init__.py`."""
