"""What phrases of a kitchen mean: the propositions, and the words for what they are about."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from pytest_safemanip.errors import ConfigError, did_you_mean

RAW, CLEAN, OBJECT, FIXTURE = "RAW", "CLEAN", "OBJECT", "FIXTURE"
"""Classes of nouns; a phrase names the class, a sentence any word of it."""

_FIXTURES = (
    "cabinet",
    "cupboard",
    "door",
    "drawer",
    "enclosure",
    "fridge",
    "refrigerator",
    "freezer",
    "microwave",
    "oven",
    "toaster",
    "dishwasher",
    "shelf",
    "lid",
    "rack",
)
_OBJECTS = ("object", "item", "thing", "something", "anything", "food", "dish")
_RAW = ("meat", "chicken", "poultry", "seafood", "pork", "beef")
_CLEAN = ("salad", "fruit", "utensil", "cutlery", "tableware")
_FRIDGES = ("Fridge", "FridgeBottomFreezer", "FridgeFrenchDoor", "FridgeSideBySide", "short_fridge")
_CABINETS = (
    "Cabinet",
    "HingeCabinet",
    "HousingCabinet",
    "OpenCabinet",
    "PanelCabinet",
    "SingleCabinet",
    "short_cabinet",
    "white_cabinet",
    "wooden_cabinet",
)
KINDS: Mapping[str, tuple[str, ...]] = {
    "cabinet": _CABINETS,
    "cupboard": _CABINETS,
    "dishwasher": ("Dishwasher",),
    "drawer": ("Drawer",),
    "fridge": _FRIDGES,
    "microwave": ("Microwave", "microwave"),
    "oven": ("Oven",),
    "rack": ("DishRack", "wine_rack"),
    "refrigerator": _FRIDGES,
    "toaster": ("Toaster",),
}
"""Kinds of fixtures, in ``objects.yaml``, that a word for a fixture names."""
EVERY = frozenset({"door", "enclosure"})
"""Words that any fixture has."""
_PASSED_OVER = frozenset(
    re.findall(
        r"\w+",
        "a an the its their this that any some every all of robot gripper hand hands fingers arm "
        "please your my fully completely firmly safely then been do does did",
    )
)

PHRASES: Mapping[str, tuple[str, ...]] = {
    "contaminated": (
        "(touch|handle) RAW",
        "contact with RAW",
        "RAW (is|was|has) (touched|handled)",
        "(is|becomes|gets) contaminated",
    ),
    "clean_contact": (
        "(touch|handle) CLEAN",
        "contact with CLEAN",
        "CLEAN (is|was) (touched|handled)",
    ),
    "touched": ("(touch|handle) OBJECT", "OBJECT (is|was) (touched|handled)"),
    "sanitized": (
        "(is|was|has|are|were)? ?(washed|sanitized|sanitised|rinsed|cleaned)",
        "(wash|sanitize|sanitise|rinse|clean)( up)?",
        "washing",
    ),
    "obj_grasped": (
        "(grasp|grip|hold|pick up|take|lift|carry) (OBJECT|CLEAN|RAW)",
        "((OBJECT|CLEAN|RAW) )?(is|was) (grasp|grip|hold|pick up|take|lift|carry)",
    ),
    "obj_released": (
        "(release|drop|put down|let go|place) (OBJECT|CLEAN|RAW)",
        "let (OBJECT|CLEAN|RAW) go",
        "((OBJECT|CLEAN|RAW) )?(is|was) (release|let go|put down|place|drop)",
    ),
    "settled": (
        "(OBJECT|CLEAN|RAW) (is|was)? ?(settled?|at rest|comes? to rest|rests?|stands? still)",
        "(settle|come to rest)",
    ),
    "stable_grasp": (
        "grasp (is )?(stable|firm)",
        "grip (is )?(stable|firm)",
        "((OBJECT|CLEAN|RAW) )?(slip|tilt)",
    ),
    "reach_in": ("(reach|go) (into|inside|in) FIXTURE", "enter FIXTURE"),
    "fix_open": ("FIXTURE (is|was)? ?open(ed)?", "open FIXTURE"),
    "mech_hit": (
        "FIXTURE (hit|press on|jam|strike|meet|bump into)( OBJECT)?",
        "(jam|hit) with FIXTURE",
    ),
    "retract": (
        "FIXTURE (is |was )?(move|pull|go) back",
        "(retract|move back)( FIXTURE)?",
        "(move|pull) FIXTURE back",
    ),
    "recovered": ("FIXTURE (is |was )?(recover|recovered|safe|brought to safety)",),
    "item_in_enclosure": (
        "OBJECT (is|lies|stands) in(side)? FIXTURE already",
        "FIXTURE (is )?occupied",
    ),
    "insert_item": ("(insert|add) OBJECT( into FIXTURE)?",),
    "enclosure_cleared": ("FIXTURE (is |was )?(empty|emptied|cleared)", "(clear|empty) FIXTURE"),
    "place_in_onset": (
        "(OBJECT|CLEAN|RAW) (enter|goes? into) FIXTURE",
        "(put|place|move) (OBJECT|CLEAN|RAW) (in|into|inside) FIXTURE",
    ),
    "obj_inside": ("(OBJECT|CLEAN|RAW) (is|was)? ?(in|inside|within) FIXTURE",),
    "obj_outside": ("(OBJECT|CLEAN|RAW) (is|was)? ?(out|outside) FIXTURE",),
    "transfer": ("(pour|transfer) (OBJECT|CLEAN|RAW)?",),
    "contained": ("(OBJECT|CLEAN|RAW) (is|was)? ?contained",),
    "collision": ("(collide|bump)( into OBJECT)?", "collision"),
    "bad_contact": ("(press|push) too hard", "(bad|forbidden) contact"),
}
"""How each proposition is said; verbs in their plain form stand for their other forms, too."""
_CONTRARY = {"stable_grasp": ("slip", "tilt")}
"""Words by which a phrase says the contrary of its proposition."""

_IRREGULAR = {
    "held": "hold",
    "took": "take",
    "taken": "take",
    "let": "let",
    "went": "go",
    "gone": "go",
    "goes": "go",
    "struck": "strike",
    "met": "meet",
    "put": "put",
    "came": "come",
    "gripped": "grip",
    "gripping": "grip",
    "slipped": "slip",
    "slipping": "slip",
    "dropped": "drop",
    "dropping": "drop",
    "jammed": "jam",
    "jamming": "jam",
    "hitting": "hit",
    "letting": "let",
    "putting": "put",
    "carried": "carry",
    "carries": "carry",
    "emptied": "empty",
}
_WORD = re.compile(r"[a-z_]+(?:'t)?|\d+(?:\.\d+)?")


@dataclass(frozen=True, slots=True)
class Atom:
    """What a phrase means.

    Attributes:
        proposition: its name.
        negated: whether the phrase says that it does not hold.
        nouns: what it names beside "object" and the like.
    """

    proposition: str
    negated: bool
    nouns: tuple[str, ...] = ()


class Lexicon:
    """Phrases, and what they mean.

    Args:
        attributes: of each category of objects, as in ``tasks/objects.yaml``.
        propositions: names of all that there are; each is a phrase for itself.
    """

    def __init__(
        self, attributes: Mapping[str, Collection[str]], propositions: Collection[str]
    ) -> None:
        self._categories = frozenset(attributes)
        self._classes: dict[str, str] = {name.replace("_", " "): OBJECT for name in attributes}
        for name, held in attributes.items():
            if "raw" in held:
                self._classes[name.replace("_", " ")] = RAW
            elif {"ready_to_eat", "utensil", "container"} & set(held):
                self._classes[name.replace("_", " ")] = CLEAN
        for words, kind in ((_FIXTURES, FIXTURE), (_OBJECTS, OBJECT), (_RAW, RAW), (_CLEAN, CLEAN)):
            self._classes.update(dict.fromkeys(words, kind))
        self._names = {name: name for name in propositions}
        self._names |= {name.replace("_", " "): name for name in propositions}
        longest = sorted((*self._classes, "ready to eat food", "raw food"), key=len, reverse=True)
        self._noun = re.compile(
            r"\b(raw |clean |cooked |ready to eat )?(" + "|".join(longest) + r")(?:e?s)?\b"
        )

    def meaning(self, phrase: str) -> Atom:
        """What a phrase says.

        Raises:
            ConfigError: it is not known.
        """
        plain = words(phrase)
        negated = "not" in plain
        text = " ".join(word for word in plain if word != "not")
        name = self._names.get(text)
        if name:
            return Atom(name, negated)
        nouns: list[str] = []
        classed = self._noun.sub(lambda match: self._class(match, nouns), text)
        forms = [re.sub(r"\bit\b", kind, classed) for kind in (OBJECT, FIXTURE)]
        forms += [" ".join(map(base, form.split())) for form in forms]
        for form in dict.fromkeys(forms):
            for proposition, patterns in PHRASES.items():
                if proposition in self._names and any(re.fullmatch(p, form) for p in patterns):
                    contrary = any(word in form for word in _CONTRARY.get(proposition, ()))
                    return Atom(proposition, negated != contrary, tuple(nouns))
        raise ConfigError(
            f"{phrase.strip()!r} is not understood; {did_you_mean(text, self._names)} "
            "(the name of a proposition is understood, too: safemanip propositions)"
        )

    def clause(self, noun: str) -> str:
        """Which members of a relation a noun names, as in ``for_each``; empty if that is unknown.

        Raises:
            ConfigError: it is a kind of fixtures of which nothing is known.
        """
        if noun in KINDS:
            return f"of {' or '.join(KINDS[noun])}"
        if noun in _FIXTURES and noun not in EVERY:
            raise ConfigError(
                f"no kind of fixtures is known that {noun!r} names; such are {', '.join(KINDS)}"
            )
        name = noun.replace(" ", "_")
        return f"of {name}" if name in self._categories else ""

    def _class(self, match: re.Match[str], nouns: list[str]) -> str:
        said = (match[1] or "").strip()
        kind = self._classes.get(match[2], "")
        if said == "raw" or match[2] == "raw food":
            kind = RAW
        elif said or match[2] == "ready to eat food":
            kind = CLEAN
        if match[2] not in _OBJECTS:
            nouns.append(f"{said} {match[2]}".strip())
        return kind


def words(text: str) -> list[str]:
    """The words that matter, in small letters; every negation is `not`."""
    found = []
    for word in _WORD.findall(text.lower().replace("-", " ").replace("cannot", "not")):
        if word in ("not", "no", "never", "without") or word.endswith("n't"):
            found.append("not")
        elif word not in _PASSED_OVER:
            found.append(word)
    return found


def base(word: str) -> str:
    """The plain form of a verb; other words as they are."""
    if word in _IRREGULAR:
        return _IRREGULAR[word]
    if word.isupper():
        return word
    for ending, instead in (("ing", ""), ("ied", "y"), ("ed", ""), ("es", ""), ("s", "")):
        stem = word.removesuffix(ending)
        if stem != word and len(stem) > 2:
            for form in (stem + instead, stem + "e"):
                if form in _VERBS:
                    return form
    return word


_VERBS = frozenset(re.findall(r"[a-z]+", " ".join(sum(PHRASES.values(), ()))))
