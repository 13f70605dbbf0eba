"""Readout: one shot, from light through charge and converter to captures.

| module             | content                                                         |
|--------------------|-----------------------------------------------------------------|
| `captures`         | the Dataset of the sensor, with all that its user needs         |
| `chip_combination` | all captures of a shot in one linear code of 20 or 24 bits      |
| `companding`       | a piecewise linear compression of linear codes to fewer bits    |
| `converter`        | electrons through conversion gain and analog gain to DN         |
| `interleave`       | pixels of one filter array with less light or shorter exposure  |
| `lin_log_response` | the linearisation table of a lin-log pixel                      |
| `optical_black`    | rows behind metal that show black level and dark charge         |
| `shot`             | one shot, step by step in physical order                        |
"""
