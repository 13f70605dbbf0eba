"""The allowed error is divided among its sources so that the total cost is least."""

import pytest
from isethdr_optics.imaging import accuracy_shares as shares

from isethdr_core.data.error_costs import STORE, STORE_COST, USUAL, divided


def test_shares_add_up_to_the_whole():
    of_lens = shares.KERNELS + shares.LEFT + shares.FAINT_GHOSTS / (1 - STORE)
    assert of_lens == pytest.approx(1.0, rel=1e-12)
    assert shares.CONVOLUTION == shares.FUNCTIONALS + shares.TRANSFORMS == 1.0


def test_the_share_of_the_store_is_that_of_the_cheapest_division_of_all():
    """Compare with one cheapest division over all sources, the kernel store included.

    Dividing in two steps gives the same shares: a part of the cheapest division is itself the
    cheapest division of the error that this part has.
    """
    whole = USUAL * (1 - shares.FAINT_GHOSTS)
    found = divided(whole, shares.COSTS | {"store": STORE_COST})
    # the solver finds the root to 2e-12
    assert found["store"] / USUAL == pytest.approx(STORE, rel=1e-11)
    for name, share in shares.SHARES.items():
        assert found[name] / USUAL == pytest.approx(share, rel=1e-11)
