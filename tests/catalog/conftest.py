"""Fixtures of the catalog's tests: here reports are made."""

import pytest
from isethdr_catalog import report

write_report = report.write_report


@pytest.fixture(scope="module", autouse=True)
def with_pages():
    """Undo the fixture that leaves reports out, for the tests of one file.

    The scope `package` would last to the end of the session, because this folder is no package.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report, "write_report", write_report)
        yield
