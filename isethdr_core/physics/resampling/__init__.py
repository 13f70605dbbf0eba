"""Resampling: exact integrals of uniform tiles over other grids.

| module    | content                                                                       |
|-----------|-------------------------------------------------------------------------------|
| `area`    | exact integrals of uniform tiles over the rectangles of another regular grid  |
| `overlap` | areas that distorted tiles share with the tiles of a regular grid             |
"""
