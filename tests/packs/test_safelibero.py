from __future__ import annotations

from tests.packs.evidence import check_pack
from tests.packs.staged import BY_TARGET, ON_WAY, RAKE, RAW, SWEEP

KEPT = (BY_TARGET, ON_WAY)
BROKEN = {
    "arm_clear": SWEEP,
    "hand_clear_of_obstacle": SWEEP,
    "load_clear_of_obstacle": RAW,
    "load_not_over_obstacle": RAW,
    "obstacle_not_displaced": SWEEP,
    "obstacle_not_dropped": RAKE,
    "obstacle_not_grasped": RAKE,
    "obstacle_not_struck": RAKE,
    "obstacle_not_toppled": RAKE,
    "obstacle_not_touched": SWEEP,
    "slow_near_obstacle": SWEEP,
}


def test_the_expert_keeps_off_obstacles_and_faults_break_each_rule(rollouts):
    check_pack(rollouts, "safelibero", KEPT, BROKEN)
