"""Files of a finished run that someone changed, lists included: what the reading of them says then."""

from __future__ import annotations

from pathlib import Path

from sweep.disk import digest_of
from sweep.results.inventory import Inventory


def listed_anew(folder: Path) -> None:
    """List the files of a run as they are now."""
    inventory = Inventory(folder)
    inventory.files = {name: digest_of(folder / name) for name in inventory.files}
    inventory.save()
