"""Measured lenses: tables of point spread functions or MTF over field and wavelength.

| module | holds |
|---|---|
| table | a lens's table, read from .npz or .csv and checked |
| mtf | point spread functions of MTF curves |
| spread | kernels on tiles, rotated about the axis, and light spread by them |
"""
