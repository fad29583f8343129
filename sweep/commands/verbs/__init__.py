"""The verbs of the command line, each a file: its arguments, and what it says. Heavy imports wait until it runs."""
