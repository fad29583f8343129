"""Several sensors, pixels or sets of lamps: a run for each, one filter for all of them, and their comparison."""

ALL_SENSORS = "all_sensors.parquet"
FILES = {
    ALL_SENSORS: "of a study of several sensors, one filter for all of them and one for all but each: "
    "`designed_on`, space, sensor, lights, `judged` (it was not designed on this one), objective, sensitivities, "
    "violation, `own_best` (objective of the best filter of this one alone) and parameters",
}
