"""Photometry of lamps: families as tables of candela, files of measured lamps, and rules.

| file | holds |
|---|---|
| families | bundled lamps, each within its regulation |
| luminaires | street luminaires by type of post |
| rules | limits of regulations, `rules.csv`, and the check of any table against them |
| iesna | files of LM-63 (.ies) |
| eulumdat | files of EULUMDAT (.ldt) |
| angles | conversion of the angles of such files to those of a table |
| isocandela | a plot of equal intensities |
| report | prints a lamp and its rules |
| command | `isethdr lamp` |
"""
