"""Files: measurements, calibrations and error maps as CSV and netCDF; whole files."""
