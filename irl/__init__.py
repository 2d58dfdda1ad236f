"""Active advice inverse reinforcement learning on sparse transition models.

Knows nothing of robots: task data in, policies out. Needs torch, numpy and scipy.
"""
