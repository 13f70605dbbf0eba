"""Rare light: light of rare bright paths that one of the two half buffers does not have.

A path of small probability that carries much light makes its tile far too bright. The other half
buffer has independent paths, and shows that the tile is not bright: the two buffers differ by many
standard deviations of the darker one, or the darker one has many more paths. The brighter buffer
then gets the light of the darker one in that tile, and the difference goes to the tiles around it
(`moved_light`).
"""

from __future__ import annotations

import numpy as np

from .moved_light import MovedLight, Region, Stays
from .tallies import Neighbours, path_variance

# Least difference of the buffers, in standard deviations that the paths of the darker one suggest.
# With normal noise one tile in 16,000 exceeds it, in either direction.
APART = 4.0
# If the darker buffer has this many times the samples (counted by their weights), any difference is
# enough: the darker buffer got its many paths because the other one found a bright path.
BETTER = 4.0
NEAR = Region((4, 8, 16, 32))


def move_rare_light(moved: MovedLight, near: Neighbours) -> None:
    """Move the light of rare bright paths between tiles.

    Light is moved if it changes the luminance of its tile by more than the wanted noise, and if it
    is `APART` standard deviations above the light of the other buffer, or the other buffer has
    `BETTER` times the samples.

    Parameters
    ----------
    moved : the buffers, the noise of the cameras, and the light that is moved.
    near : neighbours of the tiles.
    """
    noise = moved.noise
    variances = [path_variance([tally], near) for tally in moved.buffers]
    means = [tally.mean() for tally in moved.buffers]
    allowed = noise.share * noise.luminance.ravel()
    for g, weight in enumerate(noise.weights):
        if weight <= 0:
            continue
        factors = [tally.light.variance_factor()[g] for tally in moved.buffers]
        for bright, dark in ((0, 1), (1, 0)):
            excess = means[bright][g, 1] - means[dark][g, 1]
            apart = APART * np.sqrt(variances[dark][g, 1] * sum(factors))
            told = (excess > apart) | (factors[bright] >= BETTER * factors[dark])
            # a tile where the cameras have no noise could share its light with no tile
            is_rare = (0.5 * weight * excess > allowed) & told & (allowed > 0)
            for tile in np.flatnonzero(is_rare):
                share = means[dark][g, 1, tile] / means[bright][g, 1, tile]
                moved.move(bright, g, int(tile), Stays(share, variances[dark][g, :, tile]), NEAR)
