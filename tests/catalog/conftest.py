"""Fixtures of the catalog's tests: here reports are made."""

import pytest
from isethdr_catalog import report

write_report = report.write_report


@pytest.fixture(scope="package", autouse=True)
def with_pages():
    """Undo the fixture that leaves reports out."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report, "write_report", write_report)
        yield
