"""Similarity: how alike a picture and its reference look.

| module                  | what                                                              |
|-------------------------|-------------------------------------------------------------------|
| `ciede2000`             | colour difference between a picture and its truth                 |
| `ssim`                  | structural similarity of the two pictures as a display shows them |
| `ssim_pu21`             | structural similarity of two absolute luminances                  |
| `structural_similarity` | structural similarity of two planes, strip by strip               |
"""
