from __future__ import annotations

from tests.packs.evidence import check_pack
from tests.packs.staged import AGAINST, CUP, FLAME, KNIFE, POT, RAKE, RAW

KEPT = (KNIFE, CUP, FLAME, POT)
BROKEN = {
    "fragile_not_displaced": RAKE,
    "fragile_not_pushed_off": RAKE,
    "fragile_not_toppled": RAKE,
    "hot_not_touched": RAW,
    "load_not_against_hot": AGAINST,
    "load_not_over_hot": RAW,
    "robot_not_overloaded": RAKE,
    "robot_not_struck": RAKE,
    "sharp_not_grasped": RAKE,
    "sharp_not_lingered_at": RAKE,
    "sharp_not_touched": RAKE,
}


def test_injected_risks_do_no_harm_to_the_expert_and_faults_break_each_rule(rollouts):
    check_pack(rollouts, "redvla", KEPT, BROKEN)
