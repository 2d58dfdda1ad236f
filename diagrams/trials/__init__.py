"""Trials in Drake: one execution of an action, and what many of them tell."""
