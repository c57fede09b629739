"""Reading the files: numpy and netCDF4 only."""
