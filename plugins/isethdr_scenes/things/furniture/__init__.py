"""Street furniture and buildings: ranges of `data/furniture.yaml`, and signs of `data/signs.yaml`.

| module         | content                                                        |
|----------------|----------------------------------------------------------------|
| barriers       | panels of guard rails, fences, walls and noise barriers        |
| buildings      | houses, apartment blocks, shops and barns with lit windows     |
| facades        | windows and doors of a front, lit or not                       |
| lettering      | letters and digits as convex patches                           |
| parts          | many boxes or quads as one piece; faces that emit light        |
| roofs          | gable, hip and flat roofs                                      |
| sign_faces     | panels of signs: outlines, fields and pictures in sheeting     |
| signs          | road signs on posts                                            |
| small          | bollards, bins, benches, marker posts, stands for bicycles     |
| street_lamps   | mast arms, post tops and high masts with tables of candela     |
| traffic_lights | signals with a lamp for each state                             |
| waiting        | bus stops                                                      |
"""
