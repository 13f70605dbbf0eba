"""Prescription: a real lens from its surfaces, glasses, coatings and stop.

| module         | what                                                                          |
|----------------|-------------------------------------------------------------------------------|
| `amplitude`    | how unevenly a beam that comes in even leaves for the image                   |
| `coatings`     | coatings by name, and tables of what every surface of a prescription reflects |
| `exit_pupil`   | its stop as seen from an image point, in direction cosines                    |
| `field`        | whether its beam gets to the corners of the camera's field                    |
| `figures`      | chief rays, distortion, working f-number, relative illumination, focal length |
| `prescription` | surfaces, glasses, coatings and stop of a real lens, read from YAML; scaled   |
| `rays`         | parallel light from one field point, traced to the sensor                     |
| `rims`         | the part of a prescription's exit pupil that light off the axis fills         |
| `wavefront`    | optical paths of exact rays to the chief ray's image                          |
"""
