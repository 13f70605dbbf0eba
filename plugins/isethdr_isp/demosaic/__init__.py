"""Demosaic: every channel at every pixel, and denoising before it.

| module          | what                                                        |
|-----------------|-------------------------------------------------------------|
| `denoise`       | non-local means of a mosaic, before it is demosaiced        |
| `interpolation` | every channel at every pixel, for any periodic filter array |
| `learned`       | filters chosen by place and local class, trained            |
| `local_classes` | the kind of neighbourhood that a pixel lies in              |
| `methods`       | the demosaic methods by name                                |
"""
