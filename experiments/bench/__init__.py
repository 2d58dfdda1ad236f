"""Speed, side by side with the alternative: one module a subject, each with ``rows()``."""
