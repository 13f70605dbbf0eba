"""Lenses: the components, their fields and their ranges.

| module              | what                                                                      |
|---------------------|---------------------------------------------------------------------------|
| `isetcam_parity`    | ISETCam's optical image, for comparison only                              |
| `limits`            | ranges of the fields of lenses and flares, generous, each with its reason |
| `omissions`         | what a lens leaves out, stated in the plan and at work                    |
| `prescription_lens` | the lens `prescription`, from traced rays                                 |
| `thin_lens`         | the lenses `ideal`, `diffraction_limited` and `wavefront`                 |
"""
