"""Active advice inverse reinforcement learning on sparse transition models.

Knows nothing of robots: transition models and demonstrations in, policies out. Needs torch, numpy
and scipy.

>>> import numpy as np
>>> from irl.demonstrations import Demonstrations
>>> from irl.mdp import TransitionModel
>>> from irl.methods import learn
>>> room = np.arange(6)  # a corridor: action 0 goes left, 1 goes right, 2 stays
>>> state = np.r_[room[1:], room[:-1], room]
>>> action = np.repeat([0, 1, 2], [5, 5, 6])
>>> after = np.r_[room[:-1], room[1:], room]
>>> model = TransitionModel.from_entries(6, 3, state, action, after, np.ones(16))
>>> shown = Demonstrations.from_pairs([(0, 1), (1, 1), (2, 1), (3, 2)])
>>> learnt = learn("planning", model, shown, gamma=0.9, rng=np.random.default_rng(0))
>>> learnt.q.argmax(axis=1)  # rooms 4 and 5 were never shown
array([1, 1, 1, 2, 0, 0])
"""
