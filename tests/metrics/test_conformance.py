"""What the house asks of every metric."""

import pytest
from isethdr_metrics import isethdr_components

from isethdr_core.testing import check


@pytest.mark.parametrize("name", [c.name for c in isethdr_components()])
def test_conforms(name):
    check("metric", name)
