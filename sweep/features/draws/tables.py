"""Files of random lamps and cameras."""

from .robustness import ROBUST
from .uncertainty import RANDOM_SENSORS
from .yields import JUDGED_YIELDS

TABLES = (ROBUST, JUDGED_YIELDS, RANDOM_SENSORS)
