"""Lenses: the components, their fields and their ranges.

| module              | what                                                                      |
|---------------------|---------------------------------------------------------------------------|
| `isetcam_parity`    | ISETCam's optical image of a diffraction-limited lens                     |
| `limits`            | ranges of the fields of lenses and flares, generous, each with its reason |
| `omissions`         | what a lens spares, said in the plan before a run and again by the lens   |
| `prescription_lens` | the lens `prescription`: distortion, relative illumination                |
| `thin_lens`         | thin, shift-invariant, with a round stop of diameter focal length /       |
"""
