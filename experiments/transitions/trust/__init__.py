"""How far the transition model can be trusted: studies that compare it with trials of their own.

* `checks`: their commands, and what is printed of each;
* `validation`: how well it predicts whole-arm trials that it was not made from;
* `rules`: how often a trial speaks rightly for other pairs;
* `sensitivity`: what changes with the solver's error and with friction;
* `releases`: what becomes of a cube that is let go tilted;
* `drift`: what other releases of the simulator make of the same trials, asked through `elsewhere`.
"""
