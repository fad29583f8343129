"""`python -m sweep` is the command `sweep`."""

from .cli.start import start

if __name__ == "__main__":
    start()
