"""What is asked of a simulator, as a message and in a recording."""

from __future__ import annotations

import json

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.backend import Request
from pytest_safemanip.sim.codec import decode_request, encode_request
from pytest_safemanip.sim.staging import (
    Add,
    Cameras,
    Light,
    Move,
    Posture,
    Push,
    Put,
    SetOpen,
)

PUT = Put("obj", "in", "cab", (0.0, 0.1, 0.0), (90.0, 0.0), "shelf_1")
REQUEST = Request(
    "OpenDrawer",
    3,
    "compact",
    {"obj": ["mug", "cup"]},
    "full",
    (PUT, SetOpen("cab", 1), Push("obj", (0.5, -1.0))),
    "fast",
)
PLAIN = json.loads(json.dumps(encode_request(REQUEST)))
MOVED = PLAIN["changes"][0]


def test_a_request_survives_as_json():
    assert decode_request(PLAIN) == REQUEST


def test_so_does_every_kind_of_change():
    changes = (
        Move("obj", (0.04, 0.0), 30.0),
        Add("cup", "obj", (0.0, 0.2)),
        Posture(0.02),
        Cameras((0.0, 0.01, 0.0), 3.0),
        Light(0.5),
    )
    request = Request("OpenDrawer", 3, "compact", changes=changes, style="7")
    assert decode_request(json.loads(json.dumps(encode_request(request)))) == request


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"colour": "red"}, "unexpected keyword argument 'colour'"),
        ({"task": 1}, "what was asked of the simulator"),
        ({"seed": True}, "what was asked of the simulator"),
        ({"object_groups": ["mug"]}, "objects drawn from"),
        ({"object_groups": {"obj": "mug"}}, "objects drawn from"),
        ({"changes": 1}, "expected a list of at most 200"),
        ({"changes": [MOVED] * 201}, "expected a list of at most 200"),
        ({"changes": ["put"]}, "expected one of put, open, fill, .*, found 'put'"),
        ({"changes": [{**MOVED, "kind": ["put"]}]}, "expected one of put, open"),
        ({"changes": [{"kind": "move", "role": "obj", "by": [0.1]}]}, "by of"),
        ({"changes": [{"kind": "light", "factor": True}]}, "factor of"),
        ({"changes": [{"kind": "posture", "size": float("nan")}]}, "size of"),
        ({"style": 3}, "what was asked of the simulator"),
        ({"changes": [{"kind": "open", "role": "cab"}]}, "missing 1 required"),
        ({"changes": [{**MOVED, "relation": "under"}]}, "relation of"),
        ({"changes": [{**MOVED, "offset": [0.0, 0.0]}]}, "offset of"),
        ({"changes": [{**MOVED, "turn": [0.0, float("nan")]}]}, "turn of"),
        ({"changes": [{"kind": "open", "role": "cab", "openness": "1"}]}, "openness of"),
        ({"changes": [{"kind": "push", "role": "obj", "velocity": [1.0]}]}, "velocity of"),
        ({"changes": [{"kind": "open", "role": 1, "openness": 1.0}]}, "role of"),
    ],
)
def test_what_is_no_request_is_refused(changed, message):
    with pytest.raises(ConfigError, match=message):
        decode_request({**PLAIN, **changed})
