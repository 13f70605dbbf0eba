"""Lenses: the components, their fields and their ranges.

| module              | content                                                                   |
|---------------------|---------------------------------------------------------------------------|
| `field_point_lens`  | a lens with the pupil of one field point everywhere                       |
| `isetcam_parity`    | ISETCam's optical image, for comparison only                              |
| `limits`            | allowed ranges of the fields of lenses and flares, with their reasons     |
| `measured_lens`     | tables of point spread functions or MTF, illumination and distortion      |
| `prescription_lens` | the lens `prescription`, from traced rays                                 |
| `thin_lens`         | the lenses `ideal` and `diffraction_limited`                              |
| `wavefront_lens`    | the lens `wavefront`                                                      |
"""
