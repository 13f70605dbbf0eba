"""Which objects can be detected at all in the data of each camera: `isethdr study detection`.

| module        | what                                                                      |
|---------------|---------------------------------------------------------------------------|
| `exposing`    | the exposure that a camera chooses for a scene at any level of light      |
| `frame`       | one scene through one camera: stabilised colours, objects                 |
| `imaging`     | scenes of a dataset through the cameras: exposures, frames                |
| `lit_scene`   | the stored radiance of a scene under one lighting, imaged by the lens     |
| `questions`   | presets of a study: cameras, light levels, overrides                      |
| `stabilising` | variance stabilisation: a function of mean electrons with a noise of 1    |
| `study`       | the study: all objects, all cameras, all light levels                     |
| `threads`     | threads for the frames and windows of many scenes                         |
| `without`     | the same view rendered without people, riders and animals                 |
| `observer/`   | the channelised Hotelling observer                                        |
| `results/`    | shares, intervals and curves, and the files that show them                |
"""
