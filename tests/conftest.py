"""How long a test may take."""

import pytest


def pytest_collection_modifyitems(items):
    """What is marked ``soak`` takes as long as it takes; else pyproject.toml says how long."""
    for item in items:
        if item.get_closest_marker("soak"):
            item.add_marker(pytest.mark.timeout(0))
