"""What commands answer, as dataclasses: made of the schemas of their --json documents (docs/schema) when this is imported, and
checked against them as documents are read. results.pyi shows them to people and type checkers."""

from typing import Any  # the annotations' own

from diastole.classes import made
from diastole.record import Record

globals().update(made(__name__))
