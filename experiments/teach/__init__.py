"""Teaching by a person: a lesson in the terminal or in a page."""
