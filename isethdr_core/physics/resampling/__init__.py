"""Resampling: exact integrals of constant tiles over other grids.

| module    | what                                                                          |
|-----------|-------------------------------------------------------------------------------|
| `area`    | exact integrals of constant tiles over the rectangles of another regular grid |
| `overlap` | areas that tiles seen through a distortion share with the tiles of a regular  |
"""
