"""What goes wrong between policy and simulator while a rollout runs, of known size.

A disturbance is plain data, which is part of a recording's key and of its episode. What it does in
one rollout is its *effect*: it changes what the policy sees or what the robot is told, or pushes.
"""
