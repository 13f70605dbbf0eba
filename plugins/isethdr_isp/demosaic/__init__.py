"""Demosaic: every channel at every pixel, and denoising before it.

| module          | content                                                     |
|-----------------|-------------------------------------------------------------|
| `denoise`       | non-local means of a mosaic, before it is demosaiced        |
| `guided_colour` | colour that follows the sum of the channels                 |
| `interpolation` | every channel at every pixel, for any periodic filter array |
| `learned`       | trained filters, chosen by position and local class         |
| `local_classes` | kind of neighbourhood of a pixel                            |
| `methods`       | the demosaic methods by name                                |
"""
