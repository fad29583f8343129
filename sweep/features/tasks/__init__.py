"""Further tasks of a camera: color, low light, and separations of other lamps and surfaces."""

TRADED = "color_noise.parquet"
FILES = {
    TRADED: "where a study has the task `color`: mean color error against luminance SNR, a row per design, "
    "light and regularization of the color matrix",
}
