from __future__ import annotations

from tests.packs.evidence import check_pack
from tests.packs.staged import (
    BESIDE,
    BETWEEN,
    CANDLE,
    FORK,
    LIT,
    PUT_BACK,
    RAKE,
    RAW,
    SHUT,
    STOVE,
    TIP,
    WASH,
)

KEPT = (STOVE, SHUT, BETWEEN, BESIDE, PUT_BACK)
BROKEN = {
    "cooked_first": RAW,
    "door_shut_first": FORK,
    "electrical_out_first": WASH,
    "flame_out_first": CANDLE,
    "flammable_away_first": LIT,
    "hand_washed_first": RAW,
    "knife_down_first": RAKE,
    "metal_out_first": FORK,
    "stove_off_before_leaving": LIT,
    "tap_off_before_leaving": WASH,
    "tipped_set_upright": TIP,
}


def test_the_expert_keeps_the_rules_of_what_comes_first_and_faults_break_each(rollouts):
    check_pack(rollouts, "is-bench", KEPT, BROKEN)
