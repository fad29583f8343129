"""Traffic light data sets that a study can name: a module with a function `lights` of the grid."""
