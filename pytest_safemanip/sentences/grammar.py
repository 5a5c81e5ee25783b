"""Sentences, and the patterns that they mean.

A fixed grammar, tried form by form: what it does not know it refuses, and nothing is guessed.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sentences.lexicon import Lexicon

LONGEST = 500  # characters of a sentence
_NEVER = r"(?:do not|does not|must not|may not|should not|shall not|cannot|never|not)"
_NUMBER = r"(\d+(?:\.\d+)?|one|once|two|twice|three|four|five)"
_UNIT = r"(s|sec|seconds?|min|minutes?)"
_WORDED = {
    "once": 1.0,
    "one": 1.0,
    "twice": 2.0,
    "two": 2.0,
    "three": 3.0,
    "four": 4.0,
    "five": 5.0,
}
_CLEAN, _HYGIENE = "clean_contact", frozenset({"contaminated", "sanitized"})
_WITHIN = re.compile(rf",? within {_NUMBER} ?{_UNIT}\b")


@dataclass(slots=True)
class Rule:
    """A sentence as a pattern.

    Attributes:
        pattern: name of the pattern.
        arguments: formulas over the atoms.
        scope: name of the scope, with its events; empty for the whole rollout.
        keys: seconds and counts.
        atoms: names of propositions.
        nouns: what the sentence names, with the clause of ``for_each`` that chooses it; empty where
            propositions know no such kind.
    """

    pattern: str = ""
    arguments: tuple[str, ...] = ()
    scope: str = ""
    keys: dict[str, float] = field(default_factory=dict)
    atoms: dict[str, None] = field(default_factory=dict)
    nouns: dict[str, str] = field(default_factory=dict)

    def __str__(self) -> str:
        return f"{self.pattern}({', '.join(self.arguments)})"


def read_sentence(sentence: str, lexicon: Lexicon) -> Rule:
    """The rule that a sentence states.

    Args:
        sentence: such as ``after touching raw meat do not touch the salad until washed``.
        lexicon: what its phrases mean.

    Raises:
        ConfigError: the sentence or a phrase of it is not understood.
    """
    if len(sentence) > LONGEST:
        raise ConfigError(f"a sentence of {len(sentence)} characters; at most {LONGEST} are read")
    text = re.sub(r"\s+", " ", sentence.lower()).strip(" .!")
    for short, long in (("n't", " not"), ("can not", "cannot"), ("doesnot", "does not")):
        text = text.replace(short, long)
    rule = Rule()
    if limit := _WITHIN.search(text):
        rule.keys["within_s"] = _seconds(limit[1], limit[2])
        text = (text[: limit.start()] + text[limit.end() :]).strip(" ,")
    for form, build in _FORMS:
        if match := re.fullmatch(form, text):
            build(rule, _Phrases(rule, lexicon), **match.groupdict())
            return _touching(rule)
    raise ConfigError(
        f"no form of sentence that is known: {sentence.strip()!r}; such are: " + "; ".join(EXAMPLES)
    )


def _touching(rule: Rule) -> Rule:
    """Where nothing is raw or washed, to touch a thing is not to contaminate it.

    Raises:
        ConfigError: what is touched is no category of things.
    """
    if _CLEAN not in rule.atoms or _HYGIENE & rule.atoms.keys():
        return rule
    for noun, clause in rule.nouns.items():
        if not clause:
            raise ConfigError(f"{noun!r} is no category of objects.yaml, which 'touched' asks for")
    swap = re.compile(rf"\b{_CLEAN}\b")
    rule.arguments = tuple(swap.sub("touched", argument) for argument in rule.arguments)
    rule.scope = swap.sub("touched", rule.scope)
    rule.atoms = {swap.sub("touched", atom): None for atom in rule.atoms}
    return rule


class _Phrases:
    """Makes formulas of phrases, and keeps the atoms that they need."""

    def __init__(self, rule: Rule, lexicon: Lexicon) -> None:
        self._rule, self._lexicon = rule, lexicon

    def __call__(self, phrase: str) -> str:
        for word, sign in ((" or ", " | "), (" and ", " & ")):
            if word in phrase:
                return sign.join(self(part) for part in phrase.split(word))
        atom = self._lexicon.meaning(phrase)
        self._rule.atoms[atom.proposition] = None
        self._rule.nouns.update({noun: self._lexicon.clause(noun) for noun in atom.nouns})
        return f"!{atom.proposition}" if atom.negated else atom.proposition


def _seconds(number: str, unit: str) -> float:
    return _count(number) * (60.0 if unit.startswith("min") else 1.0)


def _count(number: str) -> float:
    return _WORDED.get(number) or float(number)


_Build = Callable[..., None]


def _simple(pattern: str, *order: str, scope: str = "") -> _Build:
    """A pattern whose arguments are these groups, in a scope over others."""

    def build(rule: Rule, said: _Phrases, **groups: str) -> None:
        rule.pattern = pattern
        rule.arguments = tuple(said(groups[name]) for name in order)
        if scope:
            name, *events = scope.split()
            rule.scope = f"{name}({', '.join(said(groups[event]) for event in events)})"

    return build


def _together(rule: Rule, said: _Phrases, a: str, b: str) -> None:
    rule.pattern = "absence"
    rule.arguments = (" & ".join(_grouped(said(phrase)) for phrase in (a, b)),)


def _grouped(formula: str) -> str:
    return f"({formula})" if "|" in formula else formula


def _timed(pattern: str, key: str) -> _Build:
    def build(rule: Rule, said: _Phrases, a: str, n: str, unit: str) -> None:
        rule.pattern, rule.arguments = pattern, (said(a),)
        rule.keys[key] = _seconds(n, unit)

    return build


def _times(pattern: str, key: str) -> _Build:
    def build(rule: Rule, said: _Phrases, a: str, n: str) -> None:
        rule.pattern, rule.arguments = pattern, (said(a),)
        rule.keys[key] = _count(n)

    return build


_AFTER = r"(?:after|once|from)"
_WHILE = r"(?:while|when|whenever|if|as long as)"
_N, _U = f"(?P<n>{_NUMBER[1:-1]})", f"(?P<unit>{_UNIT[1:-1]})"
_LESS = r"(?:at most|no more than|no longer than|not longer than)"
_LATER = r"(?:eventually|sooner or later|at some point|in the end)"
_PRECEDENCE = _simple("precedence", "a", "b")
_REACTION = _simple("instantaneous_reaction", "b", "a")
_RESPONSE = _simple("response", "a", "b")
_PAST = _simple("past_avoidance", "a", "b")
_FORMS: tuple[tuple[str, _Build], ...] = (
    (
        rf"between (?P<q>.+?) and (?P<r>.+?),? {_NEVER} (?P<b>.+)",
        _simple("absence", "b", scope="between q r"),
    ),
    (
        rf"{_AFTER} (?P<q>.+?),? {_NEVER} (?P<b>.+?) (?:until|before) (?P<r>.+)",
        _simple("absence", "b", scope="after_until q r"),
    ),
    (
        rf"{_AFTER} (?P<q>.+?),? {_NEVER} (?P<b>.+)",
        _simple("absence", "b", scope="after q"),
    ),
    (rf"before (?P<a>.+?),? {_NEVER} (?P<b>.+)", _PAST),
    (rf"{_WHILE} (?P<a>.+?),? {_NEVER} (?P<b>.+)", _together),
    (rf"{_NEVER} (?P<b>.+?) (?:until|before) (?P<a>.+)", _PAST),
    (rf"{_NEVER} (?P<b>.+?) after (?P<q>.+)", _simple("absence", "b", scope="after q")),
    (rf"{_NEVER} (?P<b>.+?) {_WHILE} (?P<a>.+)", _together),
    (rf"{_NEVER} (?P<b>.+?) unless (?P<a>.+)", _REACTION),
    (r"(?P<b>.+?) only (?:after|once) (?P<a>.+)", _PRECEDENCE),
    (r"only (?P<b>.+?) (?:after|once) (?P<a>.+)", _PRECEDENCE),
    (rf"(?P<b>.+?) only {_WHILE} (?P<a>.+)", _REACTION),
    (rf"only (?P<b>.+?) {_WHILE} (?P<a>.+)", _REACTION),
    (r"before (?P<b>.+?), (?P<a>.+)", _PRECEDENCE),
    (rf"(?P<a>.+?) (?:for )?at least {_N} ?{_U}", _timed("minimum_duration", "for_s")),
    (rf"(?P<a>.+?) (?:for )?{_LESS} {_N} ?{_U}", _timed("maximum_duration", "within_s")),
    (rf"(?P<a>.+?) (?:at least )?every {_N} ?{_U}", _timed("recurrence", "within_s")),
    (rf"(?P<a>.+?) {_LESS} {_N}(?: times)?", _times("bounded_existence", "at_most")),
    (rf"(?P<a>.+?) at least {_N}(?: times)?", _times("repeated_existence", "at_least")),
    (
        r"(?P<a>.+?) is followed by (?P<b>.+?),? (?:and )?then (?P<c>.+)",
        _simple("response_chain_1_2", "a", "b", "c"),
    ),
    (r"(?P<a>.+?) is followed by (?P<b>.+)", _RESPONSE),
    (
        rf"(?:{_WHILE}|after|once|every time|each time) (?P<a>.+?)(?:,? then|,) (?P<b>.+)",
        _RESPONSE,
    ),
    (r"(?:always keep|always|keep) (?P<a>.+)", _simple("universality", "a")),
    (r"(?P<a>.+) always", _simple("universality", "a")),
    (rf"{_LATER},? (?P<a>.+)", _simple("existence", "a")),
    (rf"(?P<a>.+?) {_LATER}", _simple("existence", "a")),
    (rf"{_NEVER} (?P<a>.+)", _simple("absence", "a")),
)
"""Forms, the special ones first, each with what makes a rule of its groups."""

EXAMPLES = (
    "after A do not B until C",
    "never A",
    "do not A before B",
    "do not A while B",
    "A only after B",
    "whenever A, B within 5 s",
    "A at most 2 times",
    "A for at most 3 s",
    "eventually A",
)
"""Forms of sentences, for people."""
