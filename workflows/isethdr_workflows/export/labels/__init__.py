"""Labels of objects as files.

| module       | content                                                                 |
|--------------|-------------------------------------------------------------------------|
| `masks`      | the visible pixels of each object, and the categories of COCO           |
| `run_length` | masks as the text that COCO files hold                                  |
| `coco`       | boxes and masks, COCO JSON                                              |
| `panoptic`   | the segment of every pixel, COCO panoptic JSON with PNG                 |
| `geometry`   | boxes of objects in metres and in a picture, from a stored scene        |
| `flow`       | motion of each pixel until the next frame, .flo                         |
| `surfaces`   | depth, distance and normals of each pixel, EXR                          |
| `boxes_3d`   | boxes in metres, with the camera, JSON                                  |
"""
