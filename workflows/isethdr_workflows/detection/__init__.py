"""Which objects can be detected at all in the data of each camera: `isethdr study detection`.

| module          | what                                                                      |
|-----------------|---------------------------------------------------------------------------|
| `curve_picture` | the curves of all cameras as one picture                                  |
| `exposing`      | the exposure that a camera chooses for a scene at any level of light      |
| `frame`         | one scene through one camera: stabilised colours, objects                 |
| `imaging`       | scenes of a dataset through the cameras: light, exposures, frames         |
| `levels`        | curves against the level of light, and where they cross                   |
| `page`          | the page, the CSV files and the Markdown table of a study                 |
| `questions`     | presets of a study: cameras, light levels, overrides                      |
| `recall`        | the recall of detectors and of the observer, for the same objects         |
| `results`       | all results of a study                                                    |
| `stabilising`   | variance stabilisation: a function of mean electrons with a noise of 1    |
| `study`         | the study: all objects, all cameras, all light levels                     |
| `tables`        | objects found by class, distance, ...; roads needed to compare cameras    |
| `threads`       | threads for the frames and windows of many scenes                         |
| `without`       | the same view rendered without people, riders and animals                 |
| `observer/`     | the channelised Hotelling observer                                        |
"""
