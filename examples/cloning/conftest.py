"""Names ``cloned:epoch_80``, and ``shaken``, which clones learn from."""

from policy import Cloned
from shaken import Shaken


def pytest_safemanip_policies():
    """Policies of this folder."""
    return {"cloned": Cloned, "shaken": Shaken}
