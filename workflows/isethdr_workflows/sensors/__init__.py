"""Sensors: studies of sensors over many decades of light and against published figures.

| module                | content                                                               |
|-----------------------|-----------------------------------------------------------------------|
| `led_flicker`         | LED lamps that short exposures miss                                   |
| `led_flicker_figures` | the two figures of `led_flicker`                                      |
| `level_curves`        | signal to noise and contrast detection of a sensor over eight decades |
| `published_figures`   | sensors against published figures                                     |
| `published_lofic`     | a LOFIC pixel against its paper                                       |
"""
