"""Charge: how a photodiode fills, overflows and shares with its neighbours.

| module              | content                                                     |
|---------------------|-------------------------------------------------------------|
| `blooming`          | charge beyond the full well runs along the column           |
| `crosstalk`         | light and electrons that neighbouring pixels collect        |
| `full_well`         | the largest charge that a photodiode holds                  |
| `soft_knee`         | fields of a photodiode with exponential overflow            |
| `soft_knee_in_time` | a soft knee under light that varies during the exposure     |
| `soft_knee_shot`    | one shot of a pixel with a soft knee                        |
"""
