"""Trials in Drake: one execution of an action, and what many of them tell.

The rooms, in reading order:

* `record`: what a trial is told, and what it reports;
* `initial_state`: the noise it draws, and how a held cube lies in the hand;
* `references`, `rig`, `scene`, `floating`: what gantry and gripper follow, their diagram, one
  simulation of it, and the course of a trial in that;
* `landing`: how a cube that was let go falls, lands and comes to rest;
* `arm`: the same with the whole station;
* `verdict`: from the cube's pose at the end to a record;
* `plan`: how many trials a class deserves, and which comes next;
* `schema`, `rows`, `writing`: the database's tables, what a row may say, one writer at a time;
* `database`: the trials of a campaign on disk;
* `counts`: from trials to transition probabilities.

No controller knows of trials; trials know the controllers.
"""
