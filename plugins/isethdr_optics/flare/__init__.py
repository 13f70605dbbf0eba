"""Flare: dirty apertures, haze, windscreens and ghosts.

| module        | content                                                                  |
|---------------|--------------------------------------------------------------------------|
| `added_light` | what windscreens and ghosts add to the image, on the sensor plane        |
| `aperture`    | the flares `ideal` and `aperture`: blades, dust and scratches            |
| `haze`        | a broad veil with a measured-style scatter function, Harvey-Shack or ABg |
| `windscreen`  | the second image that a pane of glass makes of every light               |
| `ghosts/`     | light reflected twice between surfaces of a lens prescription            |
"""
