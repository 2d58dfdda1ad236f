"""How an action is carried out: its plan in time, phase by phase, each with a watch.

* `phases`: the parts of a plan, and what to keep an eye on during each;
* `watches`: what is measured on the way, and when it says that something went wrong;
* `timeline`: a plan laid out in time, and how to brake on the way;
* `clock`: how a plan's time waits for an arm that is behind.
"""
