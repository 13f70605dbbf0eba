"""Flare: dirty apertures, haze, windscreens with drops and film, and ghosts.

| module        | content                                                                  |
|---------------|--------------------------------------------------------------------------|
| `added_light` | light that windscreens and ghosts add on the sensor plane                |
| `aperture`    | the flares `ideal` and `aperture`: blades, dust and scratches            |
| `drops`       | drops of water on the windscreen, each a lens far out of focus           |
| `film`        | a film that a wiper leaves: streaks across its stroke                    |
| `haze`        | a broad veil with the scatter function of Harvey-Shack or ABg            |
| `in_front`    | checks for flares that change the radiance in front of a lens            |
| `windscreen`  | the second image that a pane of glass makes of every light               |
| `ghosts/`     | light reflected twice between surfaces of a lens prescription            |
"""
