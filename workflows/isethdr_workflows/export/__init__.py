"""Export: stored runs as files of other programs, `isethdr export`.

| module          | content                                                                   |
|-----------------|---------------------------------------------------------------------------|
| `command`       | the command                                                               |
| `formats`       | the formats by name, and what each format writes                          |
| `exporting`     | from a selection to a folder: checks, files, manifest                     |
| `job`           | the input of a format: pictures of runs, the folder, the list of files    |
| `output_folder` | a folder that is replaced completely or not at all                        |
| `pictures/`     | PNG, moving pictures, EXR, spectral radiance, raw captures                |
| `labels/`       | objects: COCO, panoptic, boxes in metres; motion and surfaces of pixels   |
| `cards/`        | records of the whole folder: STAC, Croissant                              |
"""
