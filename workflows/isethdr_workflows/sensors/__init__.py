"""Sensors: studies of sensors over many decades of light and against published figures.

| module                | what                                                                    |
|-----------------------|-------------------------------------------------------------------------|
| `led_flicker`         | short exposures that come while a lamp is dark                          |
| `led_flicker_figures` | figures of the study `led_flicker`: lamps in every capture              |
| `level_curves`        | signal to noise and contrast detection of a sensor over eight decades   |
| `published_figures`   | what data sheets and papers state about sensors and light               |
| `published_lofic`     | gain by photon transfer, full well, largest SNR, on shots of the preset |
"""
