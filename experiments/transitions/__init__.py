"""The transition model: trials, coverage, export, and how far to trust it.

.. include:: many_machines.md
"""
