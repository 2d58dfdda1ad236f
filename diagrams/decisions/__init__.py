"""Which action a policy controller takes where it stands: by a table, by a forecast, or told.

A `Decision` is a pure function of what is seen and of the steps so far; `PolicyController` gets one
at construction.

* `steps`: the steps of an episode, and what they tell of actions;
* `deciding`: what a decision is; by a policy's table, as in the thesis, or by a person;
* `forecast`: by playing the policy ahead from the true pose.
"""

from diagrams.decisions.deciding import Choice, Correctable, Decision, Sight, Table
from diagrams.decisions.forecast import Forecast, held_goal
from diagrams.decisions.steps import By, Step

__all__ = [
    "By",
    "Choice",
    "Correctable",
    "Decision",
    "Forecast",
    "Sight",
    "Step",
    "Table",
    "held_goal",
]
