"""Pairs: the same scene with and without flare, ghosts, noise and blur; `isethdr dataset pairs`.

| module      | what                                                                              |
|-------------|-----------------------------------------------------------------------------------|
| `request`   | the request, and its settings on the command line                                 |
| `sources`   | the scenes: of a dataset, or one stored scene                                     |
| `terms`     | lens and flares of each member of a pair, and the term that each adds             |
| `exposures` | one shot of every member with one exposure: electrons by term, DN                 |
| `reference` | the truth on the pixels: XYZ, radiance in the sensor's channels, labels           |
| `arrays`    | arrays and labels of one scene and one camera, as they are written                |
| `files`     | NumPy and EXR files; the folder of a scene is either complete or absent           |
| `card`      | the description of a folder of pairs in Markdown                                  |
| `making`    | make the pairs that are missing                                                   |
"""
