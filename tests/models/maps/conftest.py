"""What tests of the maps' files share."""

import pytest


@pytest.fixture
def edit_field():
    """A function that overwrites one field of a file, by line from 1 and by column's name."""

    def edit(file, columns, line, column, text):
        rows = file.read_text().splitlines()
        fields = rows[line - 1].split(",")
        fields[columns.index(column)] = text
        rows[line - 1] = ",".join(fields)
        file.write_text("\n".join(rows))

    return edit
