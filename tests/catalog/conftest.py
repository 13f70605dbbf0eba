"""Fixtures of the catalog's tests, in which runs write their reports."""

import pytest
from isethdr_catalog import report

write_report = report.write_report


@pytest.fixture(scope="module", autouse=True)
def with_pages():
    """Undo the fixture `no_page`, which leaves reports out, for the tests of one file.

    The scope `package` would last to the end of the session, because this folder is not a package.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report, "write_report", write_report)
        yield
