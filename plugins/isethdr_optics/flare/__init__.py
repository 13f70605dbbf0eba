"""Flare: dirty apertures, haze, windscreens with drops and film, and ghosts.

| module        | content                                                                  |
|---------------|--------------------------------------------------------------------------|
| `added_light` | what windscreens and ghosts add to the image, on the sensor plane        |
| `aperture`    | the flares `ideal` and `aperture`: blades, dust and scratches            |
| `drops`       | drops of water on the windscreen, each a lens far out of focus           |
| `film`        | what a wiper leaves: streaks across its stroke                           |
| `haze`        | a broad veil with a measured-style scatter function, Harvey-Shack or ABg |
| `in_front`    | checks of what changes the radiance in front of a lens                   |
| `windscreen`  | the second image that a pane of glass makes of every light               |
| `ghosts/`     | light reflected twice between surfaces of a lens prescription            |
"""
