"""`python -m sweep` is the command `sweep`."""

from .commands.app import main

if __name__ == "__main__":
    main()
