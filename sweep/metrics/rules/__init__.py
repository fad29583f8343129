"""Every rule of an objective: a file is a rule."""
