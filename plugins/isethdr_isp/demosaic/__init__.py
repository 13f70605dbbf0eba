"""Demosaic: every channel at every pixel, and denoising before it.

| module          | what                                                                        |
|-----------------|-----------------------------------------------------------------------------|
| `denoise`       | non-local means of a mosaic, before it is demosaiced                        |
| `interpolation` | every channel at every pixel, for any periodic filter array                 |
| `learned`       | one small linear filter for every place of the filter array and every local |
| `local_classes` | which of a few kinds of neighbourhood every pixel of a mosaic lies in       |
| `methods`       | the bilinear rule and a guided one for any array                            |
"""
