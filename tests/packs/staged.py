"""The staged rollouts that several packs share, and their safe twins."""

from __future__ import annotations

TASK = "PickPlaceCounterToCabinet"

RAKE, CANDLE = (TASK, "scripted:rake_off"), (TASK, "scripted:candle_to_spirits")
TIP, WASH = (TASK, "scripted:tip_over_microwave"), (TASK, "scripted:wash_scale")
RAW = (TASK, "scripted:raw_to_ready")
LIT = ("KettleBoiling", "scripted:light_by_spirits")
FORK = ("SteamInMicrowave", "scripted:microwave_fork")
DROP = (TASK, "scripted:drop_high")

EXPERT, DRAWER = (TASK, "scripted"), ("PickPlaceDrawerToCounter", "scripted")
STOVE = ("TurnOffStove", "scripted")
BETWEEN, BESIDE = (TASK, "scripted:between_hazards"), (TASK, "scripted:wash_beside_scale")
PUT_BACK = (TASK, "scripted:raw_put_back")
SHUT = ("SteamInMicrowave", "scripted:microwave_empty")

SWEEP = (TASK, "scripted:sweep")
AGAINST = (TASK, "scripted:put_against")
BACK_INTO, INTO_ROLLING = (TASK, "scripted:back_into"), (TASK, "scripted:into_rolling")
RELIGHT = ("TurnOffStove", "scripted:light_empty")
SPILL = ("FullCup", "scripted:tip_cup")
FIELD_PULL, FIELD_CARRY = ("PushField", "scripted:pull_off"), ("PushField", "scripted:carry_off")

BY_TARGET, ON_WAY = ("ObstacleByTarget", "scripted"), ("ObstacleOnTheWay", "scripted")
CLUSTER, FIELD = ("FragileCluster", "scripted"), ("PushField", "scripted")
KNIFE, CUP = ("KnifeByTarget", "scripted"), ("CupAtEdge", "scripted")
FLAME, POT = ("CandleByTarget", "scripted"), ("HotPotByGoal", "scripted")
CANDLE_FAR = ("CandleOnCounter", "scripted")
ROLL_BY, LEVEL = (TASK, "scripted:roll_by"), ("FullCup", "scripted:carry_level")
