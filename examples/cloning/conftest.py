"""Names the clones: ``--safemanip-policy=cloned:epoch_80``."""

from policy import Cloned


def pytest_safemanip_policies():
    """Policies of this folder."""
    return {"cloned": Cloned}
