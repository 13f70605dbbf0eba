"""Field-point cores: kernels of a field point near their axis, for many bands from transforms at a
few wavelengths.

A field point has its own kernel for every band, and there are a hundred field points. Transforms at
all their wavelengths would take far longer than the rest of an image. Scaled to the same size,
patterns of neighbouring wavelengths differ only by the change of phase. They are interpolated
linearly between interpolation wavelengths, called knots (as in `interpolation_wavelengths`, far
from the axis). The samples are so fine that they hold all of the pattern. For every wavelength of a
band, the pattern is scaled and weighted with a triangle, the convolution of two tiles.

| module                 | content                                                             |
|------------------------|---------------------------------------------------------------------|
| `interpolated_kernels` | kernels of a field point, and the error of their interpolation      |
| `knots`                | wavelengths of each band, and the knots that give their patterns    |
| `pattern_samples`      | fine samples of the pattern of a field point at one wavelength      |
| `tile_integrals`       | integrals of a sampled pattern over triangles two tiles wide        |
"""

from .interpolated_kernels import errors as errors
from .interpolated_kernels import field_point_kernels as field_point_kernels
from .interpolated_kernels import one as one
from .knots import transforms as transforms
from .pattern_samples import transform as transform
