"""Parameters that one call of a proposition sets for itself: ``near(o, f, distance=0.3)``.

A call is a tuple of the proposition's name, its arguments, and ``KEY=VALUE`` for each parameter
``NAME.KEY`` that it sets.
"""

from __future__ import annotations

from collections.abc import Mapping

from pytest_safemanip.errors import TraceError, did_you_mean
from pytest_safemanip.propositions.definition import Parameters, Proposition, check_value

Settings = tuple[str, ...]


def split(proposition: Proposition, arguments: tuple[str, ...]) -> tuple[tuple[str, ...], Settings]:
    """The arguments of a call, and what it sets."""
    count = len(proposition.arguments)
    while count < len(arguments) and "=" not in arguments[count]:
        count += 1  # one too many, for whoever counts them
    return arguments[:count], arguments[count:]


def changed(
    parameters: Mapping[str, float], proposition: Proposition, settings: Settings
) -> Mapping[str, float]:
    """Values of parameters where a call sets some.

    Raises:
        TraceError: if the proposition has no such parameter, or a value is none.
    """
    own = {parameter.name for parameter in proposition.parameters}
    found: dict[str, float] = {}
    for text in settings:
        key, _, value = text.partition("=")
        name = f"{proposition.name}.{key}"
        if name not in own:
            known = [n.partition(".")[2] for n in own if n.startswith(f"{proposition.name}.")]
            hint = did_you_mean(key, known) if known else "it has none of its own"
            raise TraceError(f"{proposition.name}: no parameter {key!r}; {hint}")
        try:
            found[name] = check_value(name, float(value))
        except ValueError as error:
            raise TraceError(f"{proposition.name}: {text!r}: {error}") from error
    if isinstance(parameters, Parameters):
        return parameters.with_values(found)
    return {**parameters, **found}
