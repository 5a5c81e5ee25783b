"""Scenarios on the counter: things are fetched, carried, let go, poured, brushed against."""

from __future__ import annotations

from tests.physics.scenario import Scenario
from tests.physics.script import LIFTED, Script
from tests.physics.world import COUNTER, EDGE, HOB, WATER, Thing

LOW = COUNTER + 0.045
"""Where the hand holds something 8 cm high that stands on the counter."""
FRONT = (-0.2, -0.4, LIFTED)
TAP = WATER[1]


def can(x: float, y: float, z: float = COUNTER + 0.04, friction: float | None = None) -> Thing:
    """What the hand can hold on two sides."""
    return Thing("can", "can", "box", (0.025, 0.025, 0.04), (x, y, z), friction=friction)


def fetches(friction: float | None) -> Scenario:
    """A can is lifted and held, or slides through the fingers."""
    script = Script(FRONT).approach((-0.2, -0.1, LOW)).mark("closes").close()
    script.mark("lifts").to(1.0, z=LOW + 0.2).mark("lifted").wait(0.6).mark("end")
    return Scenario((can(-0.2, -0.1, friction=friction),), script)


def lifts_high(friction: float) -> Scenario:
    """A slippery can is lifted fast, and slides out of the fingers on the way."""
    script = Script(FRONT).approach((-0.2, -0.1, LOW)).close()
    return Scenario((can(-0.2, -0.1, friction=friction),), script.to(0.3, z=LOW + 0.4).wait(1.5))


def strikes(seconds: float, holds: float = 0.1, permitted: bool = False) -> Scenario:
    """The palm comes down on the counter within so many seconds, and leans on it for some."""
    script = (
        Script((0.3, -0.3, 1.1))
        .wait(0.2)
        .to(seconds, z=0.85)
        .wait(holds)
        .to(0.4, z=1.0)
        .mark("end")
    )
    binding = {"touch": {"counter": ("body",)}} if permitted else {}
    return Scenario((can(-0.5, -0.1),), script, binding=binding)


def sweeps(height: float, seconds: float = 0.9) -> Scenario:
    """The arm passes over a bottle, or through it."""
    bottle = Thing("bottle", "wine", "box", (0.03, 0.03, 0.1), (-0.2, -0.45, COUNTER + 0.1), 0.6)
    script = (
        Script((-0.45, -0.15, height)).mark("sweeps").to(seconds, x=0.05).mark("swept").wait(0.5)
    )
    return Scenario((bottle,), script)


def carries(height: float = 0.05, beside: float = 0.0) -> Scenario:
    """A can is carried so low that it runs into a jar, while the fingers pass over it; or higher,
    or past it.
    """
    place = (0.05, beside - 0.1, COUNTER + 0.03)
    jar = Thing("jar", "jam", "box", (0.03, 0.03, 0.03), place, 0.6)
    script = Script((-0.3, -0.4, LIFTED)).approach((-0.3, -0.1, LOW)).close()
    script.to(0.4, z=LOW + height).mark("carries").to(1.0, x=0.05).mark("carried").wait(0.3)
    return Scenario((can(-0.3, -0.1), jar), script.mark("end"))


def puts_down(x: float, height: float = 0.0) -> Scenario:
    """A can is let go somewhere at the left end of the counter."""
    script = Script(FRONT).pick((-0.2, -0.1, LOW)).to(0.7, x, -0.1).to(0.5, z=LOW + height)
    script.wait(0.2).let_go().wait(0.8).mark("end")
    return Scenario((can(-0.2, -0.1),), script)


def prepares_food(washes: bool, holds: float = 0.0) -> Scenario:
    """The hand moves raw meat, is held under the tap, takes an apple, and holds it for a while."""
    steak = Thing("steak", "steak", "box", (0.025, 0.03, 0.04), (-0.25, -0.1, COUNTER + 0.04))
    apple = Thing("apple", "apple", "ball", (0.034,) * 3, (0.0, -0.1, COUNTER + 0.034), 0.15)
    script = Script(FRONT).approach((-0.25, -0.1, LOW)).mark("raw").close()
    script.to(0.2, z=LOW + 0.02).to(0.2, z=LOW).let_go()
    script.to(0.6, TAP[0], TAP[1] - 0.16, TAP[2]).water(washes)
    script.mark("dips").to(0.3, y=TAP[1]).wait(0.15).to(0.3, y=TAP[1] - 0.16)
    script.wait(0.4).mark("dipped")
    script.to(0.3, y=TAP[1]).wait(1.3).mark("rinsed").water(False).to(0.3, y=TAP[1] - 0.16)
    script.approach((0.0, -0.1, COUNTER + 0.034)).mark("clean").close().to(0.4, z=LIFTED)
    return Scenario((steak, apple), script.wait(holds).mark("end"))


def takes(stacked: bool) -> Scenario:
    """A can is taken away; something stands on it, or beside it."""
    place = (-0.2, -0.1, COUNTER + 0.1) if stacked else (-0.05, -0.1, COUNTER + 0.02)
    butter = Thing("butter", "butter_stick", "box", (0.02, 0.02, 0.02), place, 0.1)
    script = Script(FRONT).approach((-0.2, -0.1, LOW)).mark("closes").close().mark("closed")
    script.to(0.6, z=LIFTED).wait(0.4)
    return Scenario((can(-0.2, -0.1), butter), script)


def pours(beside: float) -> Scenario:
    """A cherry is poured out of a cup, over a pan or a little beside it; a bowl is farther off."""
    cup = Thing("cup", "cup", "bowl", (0.03, 0.03, 0.045), (-0.35, -0.1, COUNTER + 0.045), 0.1)
    cherry = Thing("cherry", "cherry", "ball", (0.012,) * 3, (-0.35, -0.1, COUNTER + 0.02), 0.02)
    pan = Thing("pan", "pan", "bowl", (0.1, 0.1, 0.025), (0.0, -0.1, COUNTER + 0.025), 0.8)
    bowl = Thing("bowl", "bowl", "bowl", (0.05, 0.05, 0.025), (0.2, -0.1, COUNTER + 0.025), 0.4)
    script = Script((-0.35, -0.4, LIFTED)).pick((-0.35, -0.1, COUNTER + 0.05))
    script.to(0.8, x=-0.07 - beside, z=1.04).mark("pours").to(0.9, roll=2.0).wait(0.3)
    script.mark("poured").to(0.6, roll=0.0).wait(0.6)
    task = {"transfers": (("cherry", "pan"),)}
    return Scenario((cup, cherry, pan, bowl), script, binding=task)


def pours_water(beside: float) -> Scenario:
    """Water is poured out of a cup, over a pan or a little beside it."""
    cup = Thing("cup", "cup", "bowl", (0.03, 0.03, 0.045), (-0.35, -0.1, COUNTER + 0.045), 0.1)
    pan = Thing("pan", "pan", "bowl", (0.1, 0.1, 0.04), (0.0, -0.1, COUNTER + 0.04), 0.8)
    script = Script((-0.35, -0.4, LIFTED)).pick((-0.35, -0.1, COUNTER + 0.05))
    script.to(0.8, x=-0.05 - beside, z=1.04).mark("pours").to(0.9, roll=2.3).wait(0.4)
    script.mark("poured").to(0.6, roll=0.0).wait(0.6).mark("end")
    spots = [(x, y) for x in (-0.013, 0.0, 0.013) for y in (-0.013, 0.0, 0.013)]
    water = [(-0.35 + x, -0.1 + y, COUNTER + z) for z in (0.015, 0.03) for x, y in spots]
    task = {"transfers": (("water", "pan"),), "liquids": {"water": "cup"}}
    return Scenario((cup, pan), script, binding=task, water=tuple(water))


def heats(burns: bool) -> Scenario:
    """A can is put on the burner, and taken off again."""
    script = Script((-0.2, -0.55, LIFTED)).pick((-0.2, -0.4, LOW)).burner(burns)
    script.to(0.6, *HOB).mark("onto").to(0.5, z=LOW + 0.004).wait(1.0).mark("off")
    script.to(0.4, z=LIFTED).mark("away").to(0.5, x=-0.2).wait(0.3).mark("end")
    return Scenario((can(-0.2, -0.4),), script)


def brushes() -> Scenario:
    """The arm shoves a sponge, the fingers a bun, both gently; the palm presses on the counter."""
    light = {"shape": "box", "half": (0.03, 0.03, 0.04), "mass": 0.02, "friction": 0.3}
    sponge = Thing("sponge", "sponge", place=(-0.3, -0.45, COUNTER + 0.04), **light)
    bun = Thing("bun", "hotdog_bun", place=(0.1, -0.1, COUNTER + 0.04), **light)
    script = Script((-0.4, -0.1, 0.95)).mark("shoves").to(1.0, x=-0.335).to(0.4, x=-0.36)
    script.mark("shoved").to(0.3, z=LIFTED).to(0.5, x=-0.05).to(0.4, z=0.95)
    script.mark("nudges").to(2.0, x=0.03).to(0.4, x=0.0).mark("nudged").to(0.3, z=LIFTED)
    script.to(0.4, x=0.3, y=-0.3).to(0.4, z=0.935).mark("presses").to(0.3, z=0.915)
    script.mark("pressed").to(0.3, z=1.0)
    return Scenario((sponge, bun), script, binding={"touch": {}})


def squeezes() -> Scenario:
    """The fingers close on a can for a moment only."""
    script = Script(FRONT).approach((-0.2, -0.1, LOW)).mark("closes").close(0.2, hold=0.0).open(0.5)
    return Scenario((can(-0.2, -0.1),), script.mark("end"))


def pushes() -> Scenario:
    """Closed fingers push a can along the counter, and leave it there."""
    can = Thing("can", "can", "box", (0.025, 0.025, 0.04), (-0.2, -0.15, COUNTER + 0.04), 0.6)
    script = Script(FRONT).close().to(0.4, z=LOW).mark("pushes").to(1.5, y=-0.15).wait(0.2)
    return Scenario((can,), script.to(0.4, y=-0.4).wait(0.3).mark("end"))


def lies_there() -> Scenario:
    """Meat, an apple near it, and a can at the very edge; the hand stays away."""
    steak = Thing("steak", "steak", "box", (0.025, 0.03, 0.04), (0.0, -0.1, COUNTER + 0.04))
    apple = Thing("apple", "apple", "ball", (0.034,) * 3, (0.1, -0.1, COUNTER + 0.034), 0.15)
    script = Script(FRONT).wait(1.0).mark("end")
    return Scenario((steak, apple, can(EDGE + 0.003, -0.1)), script, door=0.85)
