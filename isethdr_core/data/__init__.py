"""Data: what crosses the borders between stages, with its units and checks.

| module                | what                                                                   |
|-----------------------|------------------------------------------------------------------------|
| `camera_geometry`     | where a sensor looks: projection, distortion, relative illumination    |
| `categories`          | names and numbers of object categories                                 |
| `error_costs`         | what a smaller error costs, and the division of an error at least cost |
| `derived_once`        | what metrics derive from reference picture and labels alone, kept      |
| `quantities`          | dims, units and attributes of radiance, irradiance, captures, pictures |
| `reference_picture`   | the picture of a camera without noise, blur and flare, and its labels  |
| `saturation`          | which pixels of a picture are saturated in every capture               |
| `scene_description`   | geometry, materials, lamps, camera and sky, in metres and candela      |
| `sky`                 | a sky with a gradient: radiance by direction, sun and moon             |
| `scores`              | one row per metric and object, and how sure a metric is of them        |
| `temporal_modulation` | light components that vary in time, each with one modulation           |
"""
