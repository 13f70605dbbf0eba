"""Optics: convolution methods, coloured streaks and ghosts.

| module                | what                                                                   |
|-----------------------|------------------------------------------------------------------------|
| `coloured_streaks`    | streaks of a dusty lens: one wavelength per band, and whole bands      |
| `convolution_methods` | error against run time beside lamps of up to 1e12 times the background |
| `ghosts_night`        | ghosts of a night drive, bare glass and coated                         |
"""
