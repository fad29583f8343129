"""`python -m sweep` is the command `sweep`."""

from .commands.start import start

if __name__ == "__main__":
    start()
