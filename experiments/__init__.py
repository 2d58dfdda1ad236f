"""One runnable module per story; each tells it from top to bottom."""
