"""Separations over the image height of a scene with a field."""

SENSOR_MAP = "sensor_map.parquet"
FILES = {
    SENSOR_MAP: "where a scene has a `field`, for each plain CFA, named design and answer of the search: "
    "`design_id`, relative image `height`, `cra_deg` and the CSDs there, DN, before clipping and rounding",
}
