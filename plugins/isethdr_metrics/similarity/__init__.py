"""Similarity of a picture and its reference picture.

| module                  | content                                                       |
|-------------------------|---------------------------------------------------------------|
| `ciede2000`             | colour difference between a picture and its reference picture |
| `ssim`                  | structural similarity of the displayed pictures               |
| `ssim_pu21`             | structural similarity of absolute luminances, PU21-encoded    |
| `structural_similarity` | structural similarity of two planes, in strips                |
"""
