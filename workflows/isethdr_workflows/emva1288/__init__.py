"""EMVA 1288: simulated cameras measured by the machine vision standard.

| module      | what                                                                            |
|-------------|---------------------------------------------------------------------------------|
| `camera`    | even narrow-band light of known photons, pairs and stacks of pictures           |
| `dark`      | so many pictures without light that what differs from pixel to pixel stands out |
| `estimates` | the estimates of EMVA 1288 (release 4.0, linear model) from pictures alone      |
| `general`   | EMVA 1288 for cameras whose numbers are not linear in light: companded codes    |
| `study`     | the standard's procedure must find what the camera was made of                  |
"""
