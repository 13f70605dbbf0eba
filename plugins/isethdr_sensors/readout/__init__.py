"""Readout: one shot, from light through charge and converter to captures.

| module             | content                                                         |
|--------------------|-----------------------------------------------------------------|
| `captures`         | the Dataset that leaves the sensor, with all that reads it back |
| `chip_combination` | all captures of a shot in one linear code of 20 or 24 bits      |
| `companding`       | a piecewise linear squeeze of linear codes into fewer bits      |
| `converter`        | electrons through conversion gain and analog gain to DN         |
| `interleave`       | pixels of one filter array that collect or expose less          |
| `lin_log_response` | the table that reads a lin-log pixel back                       |
| `optical_black`    | rows behind metal that show black level and dark charge         |
| `shot`             | one shot in the order in which it happens                       |
"""
