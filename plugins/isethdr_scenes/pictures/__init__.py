"""The user's own pictures and spectral cubes, as scenes.

| module | holds |
|---|---|
| picture_file | the component `scene=file`: fields, checks, scene radiance |
| arrays | a NumPy array stored as a file, so that `scene=array` finds it |
| formats | the reader of each format; decoding, and checks of the values |
| content | what a file holds before its unit is applied |
| exr_picture | OpenEXR: RGB, luminance, or spectral channels `S0.<nm>nm` |
| radiance_hdr | Radiance HDR (RGBE), new and old run lengths |
| numpy_picture | NumPy .npy and .npz |
| tiff_picture | TIFF |
| photo | PNG, JPEG, BMP and WebP |
| cube_dataset | spectral cubes with coordinates: zarr and NetCDF, through xarray |
| units | units of light that files may have, and their conversion to radiance |
| primaries | RGB of other primaries as linear sRGB |
| rgb_to_spectra | the smoothest spectra of RGB colours |
"""

from .arrays import array_scene as array_scene
