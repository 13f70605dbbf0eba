"""Prescription: a real lens from its surfaces, glasses, coatings and stop.

| module         | content                                                                       |
|----------------|-------------------------------------------------------------------------------|
| `amplitude`    | amplitude over the exit pupil, as Zernike coefficients                        |
| `coatings`     | coatings by name, and the reflectance of every surface                        |
| `exit_pupil`   | the stop as seen from an image point, in direction cosines                    |
| `field`        | check that the beam reaches the corners of the camera's field                 |
| `figures`      | chief rays, distortion, working f-number, relative illumination, focal length |
| `prescription` | surfaces, glasses, coatings and stop of a lens, read from YAML                |
| `rays`         | parallel light from one field point, traced to the sensor                     |
| `rims`         | vignetting: the part of the exit pupil that rims of other surfaces leave open |
| `wavefront`    | optical paths of exact rays, as Zernike coefficients                          |
"""
