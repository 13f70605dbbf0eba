"""Lens files of other programs: Zemax .zmx, CODE V .seq and PBRT .dat as lens prescriptions.

| module | holds |
|---|---|
| command | `isethdr lens import` |
| importing | from a lens file to a prescription, its figures, and its YAML |
| lens_data | content of a lens file of any program, in millimetres |
| glasses | glasses by name, catalogue file .agf or six-digit code |
| zemax | reads .zmx |
| code_v | reads .seq |
| pbrt | reads .dat |
"""
