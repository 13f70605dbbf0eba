"""Cameras over a dataset: scores, and which objects can be detected, `isethdr dataset score`.

| module      | what                                                                              |
|-------------|-----------------------------------------------------------------------------------|
| `cameras`   | image every scene through the cameras, and collect the scores                     |
| `intervals` | means with 95 % intervals over roads                                              |
| `tables`    | scores by camera; objects by class, distance and illuminance                      |
| `files`     | the page and the CSV files of a study                                             |
| `markdown`  | the same tables in Markdown, and means with their intervals as text               |
"""
