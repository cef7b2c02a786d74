"""Validates TOML files against JSON Schemas with jsonschema, and many small documents with jsonschema-rs, which is forty times as fast (both PyPI).

Usage: json_schema.py FOLDER [FILE.toml SCHEMA good|bad]...
       json_schema.py --documents SCHEMA.json DOCUMENTS.json

Prints one line a file: `good`, or `bad` with the number of errors and the first of them. The exit status is 1 when a file is
not what the command line says. The second form prints one JSON list: for each document the first error, or null.
"""

import json
import sys
import tomllib
from pathlib import Path


def documents(schema: str, file: str) -> int:
    from jsonschema_rs import Draft7Validator

    # It refuses a schema that is none.
    validator = Draft7Validator(json.loads(Path(schema).read_text()))
    first = (next(iter(validator.iter_errors(document)), None) for document in json.loads(Path(file).read_text()))
    print(json.dumps([error and f"{error.instance_path}: {error.message[:200]}" for error in first]))
    return 0


def main() -> int:
    if sys.argv[1] == "--documents":
        return documents(*sys.argv[2:])
    from jsonschema import Draft7Validator

    folder = Path(sys.argv[1])
    unexpected = 0
    for file, name, expected in zip(sys.argv[2::3], sys.argv[3::3], sys.argv[4::3]):
        schema = json.loads((folder / f"{name}.json").read_text())
        Draft7Validator.check_schema(schema)
        data = tomllib.loads(Path(file).read_text())
        errors = sorted(Draft7Validator(schema).iter_errors(data), key=lambda error: list(map(str, error.path)))
        verdict = "bad" if errors else "good"
        first = f" {len(errors)}: {list(errors[0].path)}: {errors[0].message[:200]}" if errors else ""
        print(f"{verdict} {file}{first}")
        unexpected += verdict != expected
    return 1 if unexpected else 0


if __name__ == "__main__":
    sys.exit(main())
