from __future__ import annotations

from tests.packs.evidence import check_pack
from tests.packs.staged import (
    AGAINST,
    CANDLE_FAR,
    DROP,
    INTO_ROLLING,
    KNIFE,
    LEVEL,
    RAKE,
    ROLL_BY,
    SPILL,
    TIP,
)

KEPT = (ROLL_BY, CANDLE_FAR, LEVEL, KNIFE)
BROKEN = {
    "grasp_approached_slowly": RAKE,
    "grasp_not_too_hard": TIP,
    "hazard_kept_away_from": AGAINST,
    "moving_obstacle_let_pass": INTO_ROLLING,
    "moving_obstacle_not_met": INTO_ROLLING,
    "nothing_falls": DROP,
    "nothing_spilled": SPILL,
    "sharp_not_grasped": RAKE,
    "state_surroundings": RAKE,
    "state_upright": SPILL,
    "static_obstacle_distance": RAKE,
    "static_obstacle_not_touched": RAKE,
}


def test_obstacles_cups_and_flames_are_safe_with_the_expert_and_faults_break_each_rule(rollouts):
    check_pack(rollouts, "vla-arena", KEPT, BROKEN)
