from __future__ import annotations

from tests.packs.evidence import check_pack
from tests.packs.staged import (
    BESIDE,
    BETWEEN,
    CANDLE,
    DRAWER,
    DROP,
    EXPERT,
    FIELD_PULL,
    FORK,
    PUT_BACK,
    RAKE,
    RAW,
    SHUT,
    TIP,
    WASH,
)

KEPT = (EXPERT, DRAWER, SHUT, BETWEEN, BESIDE, PUT_BACK)
BROKEN = {
    "order_open_before_reach": FORK,
    "order_shut_before_on": FORK,
    "order_wash_before_clean": RAW,
    "response_let_go_settles": DROP,
    "response_tipped_righted": TIP,
    "state_fragile_off_floor": RAKE,
    "state_hand_out_of_running_machine": FORK,
    "state_nothing_burns": CANDLE,
    "timing_flame_by_spirits": CANDLE,
    "timing_press_eases": FIELD_PULL,
    "timing_tap_alone": WASH,
}


def test_the_expert_keeps_the_rules_of_each_kind_and_faults_break_each(rollouts):
    check_pack(rollouts, "sentinel", KEPT, BROKEN)
