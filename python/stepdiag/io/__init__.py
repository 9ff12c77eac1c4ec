"""Files: measurements, calibrations and error maps as CSV and netCDF; text files, written whole or not at all."""
