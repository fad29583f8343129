"""Files of lamps that norms allow, and of reds that move."""

from .allowed_lamps import ALLOWED_LAMPS
from .moved_lamps import MOVED_LAMPS

TABLES = (ALLOWED_LAMPS, MOVED_LAMPS)
