"""A small kitchen with a hand, as MuJoCo reads it: counter, cabinet, tap, hob, things, water.

Bodies are named as RoboCasa and robosuite name theirs, so that the package's own tables tell
which geom is which part. The hand points along y, opens along x and rolls about y.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

Place = tuple[float, float, float]

TIMESTEP = 0.0025
"""Divides the control periods of 20 Hz and of 40 Hz."""
COUNTER = 0.9
SHELF = 0.92
"""Heights of what things stand on, m."""
EDGE = -0.7
"""Where the counter ends on the left, x."""
HINGE = np.array((0.085, -0.012))
DOOR_TRAVEL = 1.6
BAR = np.array((0.45, 0.06))
"""The door's handle: from the hinge along the door, and in front of it, m."""
BAR_HEIGHT = 1.07
FINGER_OPEN = 0.05
INTERIOR = ((0.25, 0.15, 0.15), (0.35, 0.15, 1.07))
WATER = ((0.02, 0.02, 0.12), (-0.5, 0.05, 1.02))
"""Half extents and centre of the shelf's interior, and of the space below the tap."""
HOB = (-0.5, -0.45)
BURNER = ((0.06, 0.06, 0.03), (*HOB, 0.93))
"""Where the hob lies on the counter, x and y; half extents and centre of what its flame heats."""
DROP = 0.006
"""Radius of a particle of water, m."""
CAMERA = ((2.0, -0.2, 1.5), (0.5, 0.5, 0.5, 0.5))
"""Place and orientation: it looks along -x, from the right."""


@dataclass(frozen=True)
class Solver:
    """How the same world is computed.

    Attributes:
        substeps: physics steps for each of the script's, which are :data:`TIMESTEP` long.
        stiffness: of all contacts, as a multiple of MuJoCo's default.
    """

    substeps: int = 1
    stiffness: float = 1.0


@dataclass(frozen=True)
class Thing:
    """A movable object.

    Attributes:
        name: of the entity.
        category: of RoboCasa's.
        shape: ``box``, ``ball`` or ``bowl``: a floor and four walls, open at the top.
        half: half extents of its box, m.
        place: where its centre is at first.
        mass: kg.
        friction: of its surface, whatever touches it; None for that of wood on rubber.
    """

    name: str
    category: str
    shape: str
    half: tuple[float, float, float]
    place: tuple[float, float, float]
    mass: float = 0.2
    friction: float | None = None


def bar_at(angle: float) -> np.ndarray:
    """Where the door's handle is when the door stands at an angle: x and y."""
    along = np.array((np.cos(angle), -np.sin(angle)))
    front = np.array((-np.sin(angle), -np.cos(angle)))
    return HINGE + BAR[0] * along + BAR[1] * front


def mjcf(things: Sequence[Thing], solver: Solver, water: Sequence[Place] = ()) -> str:
    """The world with these things, and particles of water in these places, in it."""
    return _WORLD.format(
        timestep=TIMESTEP / solver.substeps,
        timeconst=0.02 / np.sqrt(solver.stiffness),
        things="".join(map(_thing, things)),
        drops="".join(_drop(number, place) for number, place in enumerate(water)),
        inside=_vector(INTERIOR[1]),
        tap=_vector(WATER[1]),
        hob=_vector((*HOB, COUNTER + 0.002)),
    )


def _thing(thing: Thing) -> str:
    own = "" if thing.friction is None else f'priority="1" friction="{thing.friction} .001 .0001"'
    pieces = {"box": _box, "ball": _ball, "bowl": _bowl}[thing.shape](thing)
    mass = thing.mass / len(pieces)
    geoms = "".join(f'<geom mass="{mass}" {own} {piece}/>' for piece in pieces)
    return f'<body name="{thing.name}" pos="{_vector(thing.place)}"><freejoint/>{geoms}</body>'


def _drop(number: int, place: Place) -> str:
    return (
        f'<body name="water/{number}" pos="{_vector(place)}"><freejoint/><geom type="sphere" '
        f'size="{DROP}" density="1000" condim="6" priority="1" friction=".3 .0005 .0005" '
        'solref=".005 1"/></body>'
    )


def _box(thing: Thing) -> list[str]:
    return [_block(thing.half)]


def _ball(thing: Thing) -> list[str]:
    # Without rolling friction a ball never comes to rest.
    return [f'size="{thing.half[0]}" condim="6" friction="1 .005 .002"']


def _bowl(thing: Thing, wall: float = 0.003) -> list[str]:
    x, y, z = thing.half
    sides = [_block((wall, y, z), (sign * (x - wall), 0, 0)) for sign in (-1, 1)]
    ends = [_block((x, wall, z), (0, sign * (y - wall), 0)) for sign in (-1, 1)]
    return [_block((x, y, wall), (0, 0, wall - z)), *sides, *ends]


def _block(half: tuple[float, ...], place: tuple[float, ...] = (0.0, 0.0, 0.0)) -> str:
    return f'type="box" size="{_vector(half)}" pos="{_vector(place)}"'


def _vector(values: Sequence[float]) -> str:
    return " ".join(f"{value:.6g}" for value in values)


# The door is excluded from its frame: it hangs in it with less play than the solver's margin.
# The fingers are coupled as a gripper's gears couple them: what they hold cannot drift sideways.
_WORLD = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{timestep}" integrator="implicitfast" cone="elliptic" impratio="10"/>
  <default>
    <geom condim="4" friction="1 .005 .0001" solref="{timeconst} 1"/>
    <default class="finger">
      <geom type="box" size=".008 .035 .012" pos="0 -.01 0" mass=".05"/>
      <joint type="slide" range="0 .05" damping="5"/>
      <position kp="2000" kv="20" forcerange="-20 20"/>
    </default>
  </default>
  <worldbody>
    <body name="floor"><geom type="box" size="2 2 .05" pos="0 0 -.05"/></body>
    <body name="counter">
      <geom type="box" size=".7 .525 .45" pos="0 -.175 .45"/>
    </body>
    <body name="cabinet">
      <geom type="box" size=".27 .15 .01" pos=".35 .15 .91"/>
      <geom type="box" size=".27 .15 .01" pos=".35 .15 1.23"/>
      <geom type="box" size=".01 .15 .15" pos=".09 .15 1.07"/>
      <geom type="box" size=".01 .15 .15" pos=".61 .15 1.07"/>
      <geom type="box" size=".27 .01 .16" pos=".35 .31 1.07"/>
      <site name="inside" pos="{inside}"/>
      <body name="cabinet_hingedoor" pos=".085 -.012 1.07">
        <joint name="cabinet_doorhinge" axis="0 0 -1" range="0 1.6" damping=".3"
               frictionloss=".15" armature=".01"/>
        <geom name="cabinet_panel" type="box" size=".255 .008 .14" pos=".26 0 0" mass="1"/>
        <geom name="cabinet_door_handle" type="cylinder" size=".012 .08" pos=".45 -.06 0"
              mass=".1"/>
      </body>
    </body>
    <body name="sink">
      <geom type="box" size=".015 .015 .17" pos="-.5 .3 1.07"/>
      <geom type="box" size=".015 .14 .015" pos="-.5 .16 1.255"/>
      <site name="water" pos="{tap}"/>
    </body>
    <body name="stove" pos="{hob}"><geom type="box" size=".09 .09 .002"/></body>
    {things}
    {drops}
    <body name="robot0_base" gravcomp="1">
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="y" type="slide" axis="0 1 0"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <joint name="roll" axis="0 1 0" armature=".02"/>
      <geom type="box" size=".02 .03 .02" pos="0 -.53 0" mass=".3"/>
      <body name="robot0_link7" gravcomp="1">
        <geom type="box" size=".02 .19 .02" pos="0 -.31 0" mass=".5"/>
        <body name="gripper0_right_hand" gravcomp="1">
          <geom name="gripper0_right_palm" type="box" size=".05 .03 .025" pos="0 -.075 0"
                mass=".3"/>
          <site name="grip"/>
          <body name="gripper0_right_leftfinger" pos="-.008 0 0" gravcomp="1">
            <joint name="left" class="finger" axis="-1 0 0"/>
            <geom name="gripper0_right_left" class="finger"/>
          </body>
          <body name="gripper0_right_rightfinger" pos=".008 0 0" gravcomp="1">
            <joint name="right" class="finger" axis="1 0 0"/>
            <geom name="gripper0_right_right" class="finger"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <contact><exclude body1="cabinet" body2="cabinet_hingedoor"/></contact>
  <equality><joint joint1="left" joint2="right" solref=".005 1"/></equality>
  <actuator>
    <position joint="x" kp="3000" kv="140" forcerange="-60 60"/>
    <position joint="y" kp="3000" kv="140" forcerange="-60 60"/>
    <position joint="z" kp="5000" kv="180" forcerange="-80 80"/>
    <position joint="roll" kp="60" kv="3"/>
    <position joint="left" class="finger"/>
    <position joint="right" class="finger"/>
  </actuator>
</mujoco>
"""
