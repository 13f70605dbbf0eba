"""Timing: when each row is exposed, and for how long.

| module            | content                                                                    |
|-------------------|----------------------------------------------------------------------------|
| `auto_exposure`   | the exposure time and gain at which the metered level meets its target     |
| `exposure_limits` | the exposures that motion and flickering lamps allow                       |
| `exposure_timing` | when each row of each capture is exposed                                   |
| `metering`        | the level of the mean electrons that an exposure rule measures             |
"""
