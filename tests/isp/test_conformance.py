"""What the house asks of every isp."""

import pytest

from isethdr_core.testing import check


@pytest.mark.parametrize("name", ["ideal", "linear", "merge"])
def test_conforms(name):
    check("isp", name)
