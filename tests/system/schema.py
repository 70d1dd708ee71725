"""results.json against the schema that evalsuite ships."""

from __future__ import annotations

import json
from importlib.resources import files

import jsonschema

RESULTS = json.loads(files("evalsuite.store").joinpath("results.schema.json").read_text(encoding="utf-8"))


def validate(results: dict) -> None:
    """Raises jsonschema.ValidationError."""
    jsonschema.Draft202012Validator(RESULTS).validate(results)
