"""Charge: how a photodiode fills, overflows and shares with its neighbours.

| module              | what                                                                      |
|---------------------|---------------------------------------------------------------------------|
| `blooming`          | charge beyond the full well runs along the column into wells that still   |
| `crosstalk`         | light and electrons that a neighbour collects                             |
| `full_well`         | a photodiode holds no more charge than this; what comes later is drained  |
| `soft_knee`         | the fields of a photodiode whose charge overflows exponentially as it     |
| `soft_knee_in_time` | the charge of a pixel with a soft knee under light that varies during its |
| `soft_knee_shot`    | as `shot`, with the photodiode's charge and what spilled from it kept     |
"""
