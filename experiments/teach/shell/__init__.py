"""Teaching by what is typed, or by a script, in place of the page."""
