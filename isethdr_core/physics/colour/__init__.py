"""Colour: colour spaces and differences, and a basis for spectra.

| module           | content                                                        |
|------------------|----------------------------------------------------------------|
| `colour_spaces`  | XYZ to linear and encoded sRGB, CIELAB, colour differences     |
| `spectral_basis` | a few numbers per spectrum that determine a sensor's response  |
"""
