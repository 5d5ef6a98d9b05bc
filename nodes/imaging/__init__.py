"""Where pictures come from: projection, calibrations, videos."""
