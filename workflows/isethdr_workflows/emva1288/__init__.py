"""EMVA 1288: simulated cameras measured by the machine vision standard.

| module      | content                                                |
|-------------|--------------------------------------------------------|
| `camera`    | a simulated camera on the standard's bench             |
| `dark`      | the dark series                                        |
| `estimates` | the standard's estimates, each with its standard error |
| `general`   | the standard's general model, for nonlinear cameras    |
| `study`     | the study `emva1288`                                   |
"""
