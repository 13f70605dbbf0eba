"""Optics: convolution methods, coloured streaks and ghosts.

| module                | what                                                                   |
|-----------------------|------------------------------------------------------------------------|
| `coloured_streaks`    | dust around a white lamp, bands of one wavelength each against bands   |
| `convolution_methods` | error against run time beside lamps of up to 1e12 times the background |
| `ghosts_night`        | headlights reflected between the surfaces of a lens, bare and coated   |
"""
