"""Kitchens to generate recordings in: counter, tap, burner, enclosure with a door, some objects.

World frame, metres. No length is a round number: what lies exactly on a limit may fall on either
side of it once the scene is turned.
"""

from __future__ import annotations

import functools

from hypothesis import strategies as st

from pytest_safemanip.propositions.binding import Binding, Zone
from pytest_safemanip.propositions.onset import SKILLS
from pytest_safemanip.resources import folder
from pytest_safemanip.spec.objects import load_attributes
from pytest_safemanip.spec.task import OBJECTS_FILE
from pytest_safemanip.trace.elements import (
    BUTTON,
    ROBOT,
    ActionEntry,
    Body,
    Box,
    Camera,
    Entity,
    Gripper,
    Joint,
    Liquid,
    Part,
    Surface,
    Switch,
)
from pytest_safemanip.trace.scene import Scene

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
TOP = 0.901
"""Height of the counter."""
SHELF = 1.203
"""Height of the enclosure's floor."""
LIMB = 3
"""Number of the part that is an arm's link."""
DOOR, TAP = 0, 1
"""Places on the joint axis."""
PLACES = {
    "counter": (-0.311, 0.023, TOP),
    "beside": (0.013, -0.217, TOP),
    "tap": (0.407, 0.009, TOP),
    "shelf": (0.017, 0.587, SHELF),
    "edge": (0.019, 0.409, SHELF + 0.113),
    "air": (0.027, 0.117, 1.311),
    "floor": (0.713, -0.819, 0.0),
}
"""Where things are put, by their lowest point."""
CAMERA_PLACES = ((0.103, 0.107, 2.311), (0.021, -0.213, 1.709))
"""Cameras look down from there: on all of the kitchen, and on the burner."""
DROPS = ((0.003, 0.005, 0.013), (0.017, -0.011, 0.013), (-0.013, 0.019, 0.027))
"""Where the water's particles are at first, from the place of the first object on."""
_SIZES = {
    "apple": (0.041, 0.041, 0.043),
    "chicken_breast": (0.057, 0.037, 0.023),
    "pan": (0.123, 0.117, 0.031),
    "sponge": (0.053, 0.037, 0.017),
    "knife": (0.093, 0.013, 0.011),
    "bowl": (0.087, 0.087, 0.047),
}
_NAMES = ("obj", "other", "third")
_CLASSES = ("HingeCabinet", "Drawer", "Microwave")
_HANDS = (
    Gripper(
        "right",
        (("finger_left",), ("finger_right",)),
        ("palm",),
        (0.047, 0.103, 0.043),
        (0.0, 0.0, -0.013),
    ),
    Gripper(
        "left",
        (("thumb",), ("index", "index_tip"), ("middle",)),
        (),
        (0.051, 0.061, 0.037),
        (0.003, 0.0, 0.017),
    ),
)
"""Robots have the first of them, or both."""


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    """Kitchens with one to three objects, and a robot with one or two hands."""
    one = st.sampled_from(sorted(_SIZES))
    few = st.lists(one, min_size=1, max_size=3)
    categories = draw(few | st.lists(one, min_size=3, max_size=3, unique=True))
    return _scene(
        dict(zip(_NAMES, categories, strict=False)),
        draw(st.sampled_from(_CLASSES)),
        draw(st.sampled_from((0.05, 0.1))),
        _HANDS[: draw(st.integers(1, len(_HANDS)))],
    )


_known = functools.cache(load_attributes)


def bind(scene: Scene) -> Binding:
    """A binding in which everything of a scene has a part to play."""
    known = _known(folder("tasks") / OBJECTS_FILE)
    objects = tuple(body.entity for body in scene.bodies)
    fixtures = tuple(e.name for e in scene.entities if e.kind == "fixture")
    categories = {name: scene.entity[name].category for name in (*objects, *fixtures)}
    kinds = {name: known.get(category, frozenset()) for name, category in categories.items()}
    doors = tuple(dict.fromkeys(j.entity for j in scene.joints if j.gives_access))
    controls = tuple(dict.fromkeys(s.entity for s in scene.switches))
    holders = (*doors, *(o for o in objects if "container" in kinds[o]))
    grounds = frozenset(s.entity for s in scene.surfaces if not s.joint)
    skills = {"pick": objects, "place": objects, "pour": objects, "open": doors, "close": doors}
    return Binding(
        objects=objects,
        enclosures=doors,
        exclusive_enclosures=doors,
        mechanisms=doors,
        placements=tuple((o, f) for o in objects for f in doors),
        skills=tuple((k, x) for k in SKILLS for x in skills.get(k, controls)),
        transfers=tuple((o, r) for o in objects for r in holders if o != r),
        tools=(ROBOT, *(o for o in objects if "utensil" in kinds[o])),
        things=objects,
        fixtures=fixtures,
        kinds=categories,
        zones=_zones(scene),
        touch=frozenset({*((o, "body") for o in objects), *((f, "door") for f in doors)}),
        supports={o: grounds for o in objects if "raw" not in kinds[o]},
        upright=frozenset(o for o in objects if "container" in kinds[o]),
        attributes=kinds,
    )


def _zones(scene: Scene) -> dict[str, Zone]:
    """One around the cabinet, and one around an object; their names are the same in a scene with
    other names.
    """
    return {
        "A": Zone(scene.joints[DOOR].entity, 0.113, 0.217),
        "B": Zone(scene.roles["obj"], 0.0317),
    }


def _scene(
    objects: dict[str, str], cabinet: str, period: float, hands: tuple[Gripper, ...]
) -> Scene:
    slides = cabinet == "Drawer"
    return Scene(
        control_period=period,
        entities=(
            Entity(ROBOT, "robot", "Robot"),
            Entity("counter", "fixture", "Counter"),
            Entity("cab", "fixture", cabinet, ("no_metal",) if cabinet == "Microwave" else ()),
            Entity("sink", "fixture", "Sink"),
            Entity("stove", "fixture", "Stove"),
            Entity("floor", "room", "Floor"),
            Entity("water", "liquid", "water"),
            *(Entity(name, "object", category) for name, category in objects.items()),
        ),
        bodies=tuple(
            Body(name, _SIZES[category], (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.2)
            for name, category in objects.items()
        ),
        parts=(
            *(Part(ROBOT, name) for name in (*hands[0].parts, "link5")),
            Part("counter", "body"),
            Part("cab", "body"),
            Part("cab", "door", "cab/door"),
            *((Part("cab", BUTTON),) if cabinet == "Microwave" else ()),
            Part("sink", "body"),
            Part("sink", "handle", "sink/handle"),
            Part("stove", "knob", "stove/knob"),
            Part("floor", "body"),
            *(Part(name, "body") for name in objects),
            *(Part(ROBOT, name) for hand in hands[1:] for name in hand.parts),
        ),
        joints=(
            _door("slide" if slides else "hinge"),
            _control("sink/handle", (0.407, 0.217, 1.103)),
            _control("stove/knob", (0.013, -0.413, TOP)),
        ),
        boxes=(
            Box("cab", "inside", "interior", (0.303, 0.197, 0.297)),
            Box("sink", "water", "water", (0.021, 0.021, 0.203)),
            Box("stove", "front", "burner", (0.083, 0.079, 0.097)),
        ),
        switches=(
            Switch("sink", "water", "water"),
            Switch("stove", "front", "burner", "stove/knob"),
            *((Switch("cab", "power", "appliance"),) if cabinet == "Microwave" else ()),
        ),
        surfaces=(
            Surface("counter", "", (1.003, 0.351, TOP / 2), (0.0, 0.0, TOP / 2, *UPRIGHT)),
            Surface("stove", "", (0.219, 0.151, 0.007), (0.013, -0.217, TOP + 0.001, *UPRIGHT)),
            Surface("cab", "", (0.303, 0.197, 0.011), (0.0, 0.6, SHELF - 0.011, *UPRIGHT)),
            Surface("cab", "cab/door", (0.303, 0.011, 0.297), (0.0, 0.391, 1.5, *UPRIGHT)),
        ),
        grippers=hands,
        actions=tuple(ActionEntry(name) for name in ("move", *(f"close {h.name}" for h in hands))),
        roles={**{name: name for name in objects}, "counter": "counter", "cab": "cab"},
        cameras=(Camera("above", 0.71, 1.31), Camera("hob", 0.61, 1.0)),
        liquids=(Liquid("water", len(DROPS), 0.011),),
    )


def _door(kind: str) -> Joint:
    pose, half = (0.0, 0.391, 1.5, *UPRIGHT), (0.303, 0.011, 0.297)
    if kind == "slide":
        axis, anchor = (0.0, -1.0, 0.0), (0.0, 0.391, 1.5)
        return Joint("cab", "door", "slide", True, axis, anchor, 0.397, half, pose)
    axis, anchor = (0.0, 0.0, -1.0), (-0.303, 0.391, 1.5)
    return Joint("cab", "door", "hinge", True, axis, anchor, 1.51, half, pose)


def _control(key: str, place: tuple[float, float, float]) -> Joint:
    entity, name = key.split("/")
    half, pose = (0.013, 0.037, 0.013), (*place, *UPRIGHT)
    return Joint(entity, name, "hinge", False, (0.0, 0.0, 1.0), place, 1.51, half, pose)
