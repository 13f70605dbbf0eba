"""Timing: when each row is exposed, and for how long.

| module            | what                                                                       |
|-------------------|----------------------------------------------------------------------------|
| `auto_exposure`   | the time at which the metered level of the mean electrons meets its target |
| `exposure_timing` | when each row of each capture is exposed                                   |
"""
