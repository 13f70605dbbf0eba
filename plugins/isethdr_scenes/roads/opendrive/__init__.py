"""OpenDRIVE: networks of roads from files, and into files, 1.4 to 1.8.

| module       | content                                                            |
|--------------|--------------------------------------------------------------------|
| `road_file`  | a whole file: header, roads, junctions; `read` and `write`         |
| `elements`   | attributes as numbers; errors that name the file and the road      |
| `words`      | words of the format and their counterparts in this package         |
| `plan_view`  | reference lines                                                    |
| `heights`    | elevation, superelevation, crossfall, shape                        |
| `lanes`      | lane sections, types, widths, heights, links                       |
| `marks`      | road marks                                                         |
| `objects`    | crosswalks, stop lines, arrows, bridges, tunnels                   |
| `links`      | links between roads, junctions                                     |
| `gaps`       | checks that geometries and linked lanes meet                       |
| `window`     | the part of a network around a place                               |
| `overpasses` | bridges that a file does not state                                 |
| `openstreetmap` | OpenStreetMap files as OpenDRIVE, by netconvert                  |
| `file_road`  | a file as base road: the camera's lane and the roads around it     |
"""
