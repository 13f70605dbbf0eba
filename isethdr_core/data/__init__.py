"""Data: the quantities that stages exchange, with their units and checks.

| module                | content                                                                |
|-----------------------|------------------------------------------------------------------------|
| `camera_geometry`     | lines of sight of pixels: projection, distortion, relative illumination |
| `categories`          | names and numbers of object categories                                 |
| `csv_table`           | columns of numbers from a user's CSV file                              |
| `error_costs`         | the cost of a smaller error, and the division of an error at least cost |
| `derived_once`        | results of metrics that depend on reference picture and labels only    |
| `fog`                 | fog: extinction by visibility, and phase function                      |
| `quantities`          | dims, units and attributes of radiance, irradiance, captures, pictures |
| `reference_picture`   | the picture of a camera without noise, blur and flare, and its labels  |
| `saturation`          | which pixels of a picture are saturated in every capture               |
| `scene_description`   | geometry, materials, lamps, camera and sky, in metres and candela      |
| `score_checks`        | what a metric returned is a list of scores                             |
| `sky`                 | a sky with a gradient: radiance by direction, sun and moon             |
| `scores`              | one row per metric and object, with its confidence interval            |
| `temporal_modulation` | light components that vary in time, each with one modulation           |
"""
