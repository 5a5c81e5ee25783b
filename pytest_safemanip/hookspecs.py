"""Hooks that a conftest.py or another plugin can implement to extend the suite."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pytest_safemanip.policies.registry import Factory as PolicyFactory
    from pytest_safemanip.propositions.definition import Proposition
    from pytest_safemanip.sim.backend import Factory as BackendFactory


def pytest_safemanip_policies() -> Mapping[str, PolicyFactory]:  # type: ignore[empty-body]
    """Policies by the name that ``--safemanip-policy`` takes.

    The same things as behind ``MODULE:ATTRIBUTE``: a class or a factory, called without arguments
    once per rollout, an object with ``act``, or a function that is ``act`` itself. An attribute
    ``fingerprint``, if there is one, identifies what decides the actions (a digest of the weights,
    say); with it, recordings of earlier runs are used again::

        def pytest_safemanip_policies():
            return {"mine": lambda: MyPolicy("checkpoint.npz")}
    """


def pytest_safemanip_propositions() -> Sequence[Proposition]:  # type: ignore[empty-body]
    """Propositions that your own properties use.

    See :class:`pytest_safemanip.propositions.definition.Proposition`.
    """


def pytest_safemanip_backends() -> Mapping[str, BackendFactory]:  # type: ignore[empty-body]
    """Simulators by the name that ``--safemanip-backend`` takes.

    See :class:`pytest_safemanip.sim.backend.Backend`.
    """
