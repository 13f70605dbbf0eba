"""Resampling: exact integrals of uniform tiles over other grids, and means over blocks of pixels.

| module    | content                                                                       |
|-----------|-------------------------------------------------------------------------------|
| `area`    | exact integrals of uniform tiles over the rectangles of another regular grid  |
| `blocks`  | means over blocks of pixels, for each place of a colour filter array alike    |
| `overlap` | areas that distorted tiles share with the tiles of a regular grid             |
"""
