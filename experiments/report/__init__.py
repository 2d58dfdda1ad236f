"""RESULTS.md from kept results: the thesis' figures and tables beside ours."""
