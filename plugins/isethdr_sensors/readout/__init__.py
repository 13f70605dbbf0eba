"""Readout: one shot, from light through charge and converter to captures.

| module             | what                                                                       |
|--------------------|----------------------------------------------------------------------------|
| `captures`         | the Dataset that leaves the sensor                                         |
| `companding`       | a piecewise linear squeeze of linear codes into fewer bits                 |
| `converter`        | from electrons through conversion gain and analog gain to DN with a black  |
| `interleave`       | pixels of one filter array that collect less light or expose for a shorter |
| `lin_log_response` | linear DN, the electrons that have to arrive for it, and their variance    |
| `shot`             | one shot, in the order in which it happens: light, crosstalk, shot noise   |
"""
