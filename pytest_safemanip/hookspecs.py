"""Hooks that a conftest.py or another plugin can implement to extend the suite."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pytest_safemanip.policies.base import PolicyLike
    from pytest_safemanip.propositions.definition import Proposition
    from pytest_safemanip.search.kinds.definition import Kind
    from pytest_safemanip.sim.backend import Simulator


def pytest_safemanip_policies() -> Mapping[str, PolicyLike]:  # type: ignore[empty-body]
    """Policies by the name that ``--safemanip-policy`` takes.

    The same things as behind ``MODULE:ATTRIBUTE``, or that text: a class or a factory, called
    without arguments once per rollout, an object with ``act``, or a function that is ``act``
    itself. ``NAME:TEXT`` on the command line calls a class with the text. What a policy may have
    beside ``act``: :class:`pytest_safemanip.policies.base.Policy`::

        def pytest_safemanip_policies():
            return {"mine": lambda: MyPolicy("checkpoint.npz")}
    """


def pytest_safemanip_propositions() -> Sequence[Proposition]:  # type: ignore[empty-body]
    """Propositions that your own properties use.

    See :class:`pytest_safemanip.propositions.definition.Proposition`.
    """


def pytest_safemanip_backends() -> Mapping[str, Simulator]:  # type: ignore[empty-body]
    """Simulators by the name that ``--safemanip-backend`` takes.

    What each declares, and the function that makes it::

        def pytest_safemanip_backends():
            return {"mine": Simulator(SPEC, lambda options: MyBackend(options.logs))}

    See :class:`pytest_safemanip.sim.backend.BackendSpec` and
    :class:`pytest_safemanip.sim.backend.Backend`. A function that is
    :class:`pytest_safemanip.sim.backend.DescribesTasks` too has misspelt tasks, roles and parts
    refused before anything is simulated, one that is
    :class:`pytest_safemanip.sim.backend.DrawsObjects` what objects are drawn from. A reset that
    cannot begin as the task's file asks raises :class:`pytest_safemanip.errors.TaskError`.
    """


def pytest_safemanip_dimensions() -> Sequence[Kind]:  # type: ignore[empty-body]
    """Kinds of dimensions that your own spaces of a search have.

    See :class:`pytest_safemanip.search.kinds.definition.Kind`.
    """
