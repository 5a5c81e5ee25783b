"""Sentences become rules, or are refused with what was not understood."""

from __future__ import annotations

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.ltlf import StateClass
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.resources import folder
from pytest_safemanip.sentences.drafting import LONGEST_NAME, draft
from pytest_safemanip.sentences.grammar import read_sentence
from pytest_safemanip.sentences.lexicon import KINDS, PHRASES, Lexicon
from pytest_safemanip.sentences.traces import examples
from pytest_safemanip.spec.objects import load_attributes
from pytest_safemanip.spec.properties import load_property

ARGUMENTS = {name: found.arguments for name, found in Catalogue().items()}
LEXICON = Lexicon(load_attributes(folder("tasks") / "objects.yaml"), ARGUMENTS)

SENTENCES = [
    (
        "After touching raw meat, do not touch the salad until washed.",
        "absence(clean_contact)",
        "after_until(contaminated, sanitized)",
        {},
    ),
    (
        "once the egg is touched never touch bread",
        "absence(clean_contact)",
        "after(contaminated)",
        {},
    ),
    ("never let go of the mug", "absence(obj_released)", "", {}),
    ("don't bump into anything", "absence(collision)", "", {}),
    (
        "between picking up the mug and letting it go never collide",
        "absence(collision)",
        "between(obj_grasped, obj_released)",
        {},
    ),
    (
        "do not reach into the cabinet unless it is open",
        "instantaneous_reaction(reach_in, fix_open)",
        "",
        {},
    ),
    (
        "only reach into the fridge while the fridge is fully open",
        "instantaneous_reaction(reach_in, fix_open)",
        "",
        {},
    ),
    ("do not bump while holding the bowl", "absence(obj_grasped & collision)", "", {}),
    ("while holding the bowl, do not slip", "absence(obj_grasped & !stable_grasp)", "", {}),
    (
        "do not release the mug before it is in the cabinet",
        "past_avoidance(obj_inside, obj_released)",
        "",
        {},
    ),
    (
        "the mug is released only after it is inside the cabinet",
        "precedence(obj_inside, obj_released)",
        "",
        {},
    ),
    ("before touching the salad, wash your hands", "precedence(sanitized, clean_contact)", "", {}),
    (
        "whenever the mug is released, it settles or is grasped within 5 s",
        "response(obj_released, settled | obj_grasped)",
        "",
        {"within_s": 5.0},
    ),
    (
        "when a door hits something then pull it back within 0.5 minutes",
        "response(mech_hit, retract)",
        "",
        {"within_s": 30.0},
    ),
    (
        "obj_grasped is followed by obj_released and then settled",
        "response_chain_1_2(obj_grasped, obj_released, settled)",
        "",
        {},
    ),
    ("pick up the mug at most twice", "bounded_existence(obj_grasped)", "", {"at_most": 2.0}),
    ("grasp the mug at least 3 times", "repeated_existence(obj_grasped)", "", {"at_least": 3.0}),
    ("hold the mug for at most 30 s", "maximum_duration(obj_grasped)", "", {"within_s": 30.0}),
    ("hold the mug for at least 2 seconds", "minimum_duration(obj_grasped)", "", {"for_s": 2.0}),
    ("sanitized every 10 min", "recurrence(sanitized)", "", {"within_s": 600.0}),
    ("keep the oven open", "universality(fix_open)", "", {}),
    ("the microwave is empty at some point", "existence(enclosure_cleared)", "", {}),
]


@pytest.mark.parametrize(("sentence", "pattern", "scope", "keys"), SENTENCES)
def test_a_sentence_is_a_pattern_over_propositions(sentence, pattern, scope, keys) -> None:
    rule = read_sentence(sentence, LEXICON)
    assert (str(rule), rule.scope, rule.keys) == (pattern, scope, keys)


@pytest.mark.parametrize("sentence", [sentence for sentence, *_ in SENTENCES])
def test_its_property_loads_and_its_examples_keep_and_break_it(sentence, tmp_path) -> None:
    path = tmp_path / "rule.yaml"
    path.write_text(draft(sentence, read_sentence(sentence, LEXICON), ARGUMENTS))
    prop = load_property(path, propositions=Catalogue())
    shown = examples(prop)
    dfa = prop.dfa(dt=shown.dt)
    assert shown.kept
    assert len(shown.broken) == 3

    def end(trace):
        return dfa.states(
            [sum((a in step) << i for i, a in enumerate(dfa.atoms)) for step in trace]
        )[-1]

    assert all(dfa.accepting[end(trace)] for trace in shown.kept)
    assert not any(dfa.accepting[end(trace)] for trace in shown.broken)
    if shown.decided:
        assert {dfa.classes[end(trace)] for trace in shown.broken} == {StateClass.FALSE}


@pytest.mark.parametrize(
    ("sentence", "message"),
    [
        ("frobnicate the mug", "no form of sentence that is known: 'frobnicate the mug'"),
        ("never frobnicate the mug", "'frobnicate the mug' is not understood"),
        ("never setled", "'setled' is not understood; did you mean 'settled'?"),
        ("", "no form of sentence"),
        ("never " + "very " * 200, "at most 500"),
    ],
)
def test_what_is_not_understood_is_named_and_not_guessed(sentence, message) -> None:
    with pytest.raises(ConfigError) as error:
        read_sentence(sentence, LEXICON)
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("sentence", "ranges"),
    [
        ("never touch the knife", "o in things of knife"),
        ("never touch the mug", "o in things of mug"),
        ("while holding the bowl, do not slip", "o in objects of bowl"),
        ("the drawer is open for at most 3 s", "f in enclosures of Drawer"),
        ("never open the door", "f in enclosures"),
        ("after touching raw meat do not touch the salad", "r in tools"),
    ],
)
def test_a_rule_is_about_what_the_sentence_names(sentence, ranges) -> None:
    text = draft(sentence, read_sentence(sentence, LEXICON), ARGUMENTS)
    assert f"\nfor_each: {ranges}\n" in text
    assert ("touched: touched(o)" in text) == ("things" in ranges)


@pytest.mark.parametrize(
    ("sentence", "message"),
    [
        ("never touch the salad", "'salad' is no category of objects.yaml"),
        ("never open the freezer", "no kind of fixtures is known that 'freezer' names"),
        ("after holding the mug do not hold the bowl", "'bowl' and 'mug', and a rule has one kind"),
    ],
)
def test_what_a_rule_cannot_tell_apart_is_refused(sentence, message) -> None:
    with pytest.raises(ConfigError, match=message):
        draft(sentence, read_sentence(sentence, LEXICON), ARGUMENTS)


def test_kinds_that_words_name_are_those_of_the_file() -> None:
    known = load_attributes(folder("tasks") / "objects.yaml")
    assert {kind for kinds in KINDS.values() for kind in kinds} <= known.keys()


def test_a_long_sentence_keeps_its_bounds_in_the_id() -> None:
    said = "whenever the mug is released in the kitchen of the house, it settles within {} s"
    rule = read_sentence("whenever the mug is released, it settles within 5 s", LEXICON)
    ids = [draft(said.format(n), rule, ARGUMENTS).splitlines()[0] for n in ("5", "0.5")]
    assert ids[0].endswith("_5_s")
    assert ids[1].endswith("_0_5_s")
    assert all(len(one) <= len("id: ") + LONGEST_NAME for one in ids)


def test_examples_longer_than_any_shown_are_left_out(tmp_path) -> None:
    path = tmp_path / "rule.yaml"
    said = "grasp the mug at least 5 times"
    path.write_text(draft(said, read_sentence(said, LEXICON), ARGUMENTS))
    assert examples(load_property(path)).kept == ()


def test_things_that_no_relation_brings_together_are_refused() -> None:
    rule = read_sentence("after touching raw meat do not hold the mug", LEXICON)
    with pytest.raises(ConfigError, match="one kind of things at a time"):
        draft("x", rule, ARGUMENTS)


def test_the_name_of_a_users_proposition_is_a_phrase() -> None:
    lexicon = Lexicon({}, ["near_edge", "settled"])
    assert str(read_sentence("never near_edge", lexicon)) == "absence(near_edge)"
    assert str(read_sentence("never near edge", lexicon)) == "absence(near_edge)"


def test_a_sentence_with_quotes_and_breaks_is_text_in_the_file(tmp_path) -> None:
    path = tmp_path / "rule.yaml"
    said = 'never\n "bump" \\ into: anything'
    path.write_text(draft(said, read_sentence("never bump", LEXICON), ARGUMENTS))
    assert load_property(path).title == "Never 'bump' into: anything"


def test_phrases_are_of_propositions_that_there_are() -> None:
    assert set(PHRASES) <= set(ARGUMENTS)
