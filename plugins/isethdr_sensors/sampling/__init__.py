"""Sampling: where the pixels lie, and how much light each photodiode collects.

| module             | content                                                   |
|--------------------|-----------------------------------------------------------|
| `area_integration` | irradiance to the electrons per second of each photodiode |
| `isetcam_parity`   | ISETCam's spatial and voltage rules, for comparison only  |
| `microlens`        | the share of light that pixels take, by its chief ray     |
| `pixel_grid`       | where the pixels lie in the camera's field                |
"""
