"""Traffic light data sets that a study can name: a file is a data set, with a function `lights` of the grid."""
