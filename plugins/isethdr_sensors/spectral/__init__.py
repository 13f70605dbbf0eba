"""Spectral: filters, quantum efficiency, and the bands that a sensor needs.

| module                | content                                                                |
|-----------------------|------------------------------------------------------------------------|
| `band_integration`    | means of spectral curves over the bands of the light                   |
| `colour_filter_array` | a small text pattern, repeated from the upper left pixel of the sensor |
| `quantum_efficiency`  | electrons per photon of every filter                                   |
| `response`            | the request of a sensor for photocurrent, and the reading of light     |
| `spectral_curves`     | fitted curves of colour filters on silicon, and curves from CSV files  |
"""
