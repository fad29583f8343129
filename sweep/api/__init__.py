"""What the package offers to Python: studies and runs as objects; `sweep/__init__.py` gives its names out."""
