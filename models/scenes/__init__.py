"""The arms with their hands, before box and table, as Drake plants.

Read `parsing` first: it parses `models/description` and names what stored results were
computed from. `robots` tells the two arms apart, `gripper` and `lite_gripper` are their hands'
linkages, `topology` says what moves with which joint, `limits` what a joint may be asked for, and
`inputs` looks at poses before Drake does. A `setup` is another base pose, tool or surroundings, and
`assembly` builds it. `planning_scene` answers the two questions of all
planning: where is the hand at these joint angles, and what is it near to? `tool_frame` and
`postures` are what the vendor calls things: its tool frame, there and back, and its named postures.
"""
