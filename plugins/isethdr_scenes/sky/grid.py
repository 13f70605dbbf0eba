"""Rows and columns of a pattern of the sky."""

ROWS = 65  # 0.09 degrees apart at the horizon, 5.5 at the zenith
COLUMNS = 72  # 5 degrees apart
