"""The grasping task: its states and actions, and what can be said of them without a robot.

`spaces` comes first: the grid, the 48 cube orientations, the 18 gripper orientations, and the
indices of states and actions; `tables` and `words` describe them by numbers and for a person.
`discretise` names the state of measured poses. `drops` says where a cube comes to rest that is let
go, `forecast` what an action leads to from a true pose, which a name forgets, and `tracking` what
is known of the pose in the hand. `pairs` are states with an action: `estimate` says what each would
lead to, `generalisation` which follow from a demonstrated one, `symmetry`, `trial_classes` and
`kernel_rules` which share their trials.
`features` and `clusters` are what learning is told of the states.
"""
