"""What eds-pie makes of an electronic data sheet: its protocol, its values, and what its checker says against it.

Usage: eds_pie_reader.py FILE. Prints one JSON object; judged by tests/data_sheet.rs.
"""

import json
import logging
import sys

from eds_pie.eds_pie import CIP_EDS


class Kept(logging.Handler):
    """Keeps what is warned of."""

    def __init__(self):
        super().__init__(logging.WARNING)
        self.lines = []

    def emit(self, record):
        self.lines.append(record.getMessage())


def main():
    root = logging.getLogger()
    for handler in list(root.handlers):
        root.removeHandler(handler)
    kept = Kept()
    root.addHandler(kept)
    with open(sys.argv[1], "rb") as source:
        sheet = CIP_EDS(source.read())
    sections = {
        name: {keyword: [field.value for field in entry.fields] for keyword, entry in section.entries.items()}
        for name, section in sheet.sections.items()
    }
    print(json.dumps({"protocol": sheet.protocol, "sections": sections, "findings": kept.lines}, default=str))


main()
