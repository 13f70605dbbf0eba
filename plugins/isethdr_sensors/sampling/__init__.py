"""Sampling: where the pixels lie, and how much light each photodiode collects.

| module             | content                                                   |
|--------------------|-----------------------------------------------------------|
| `area_integration` | from irradiance to electrons per second of a photodiode   |
| `isetcam_parity`   | ISETCam's spatial and voltage rules, for comparison only  |
| `microlens`        | the share of light that pixels accept, by chief-ray angle |
| `pixel_grid`       | where the pixels lie in the camera's field                |
"""
