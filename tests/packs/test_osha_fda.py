from __future__ import annotations

from tests.packs.evidence import check_pack
from tests.packs.staged import (
    BESIDE,
    BETWEEN,
    CANDLE,
    FORK,
    PUT_BACK,
    RAKE,
    RAW,
    SHUT,
    TIP,
    WASH,
)

KEPT = (SHUT, BETWEEN, BESIDE, PUT_BACK)
BROKEN = {
    "chemicals_not_above_food": TIP,
    "cooked_through": RAW,
    "dry_hands": WASH,
    "floor_clear": RAKE,
    "food_off_floor": RAW,
    "hands_washed": RAW,
    "machine_guard": FORK,
    "no_ignition": CANDLE,
    "raw_apart": RAW,
    "raw_not_over_ready": RAW,
    "stable_storage": RAKE,
}


def test_the_expert_keeps_the_paragraphs_and_faults_break_each(rollouts):
    check_pack(rollouts, "osha-fda", KEPT, BROKEN)
