"""JSON Schemas of scene and campaign files, for editors.

They hold what can be said of a key by itself: names, types, units, bounds, defaults, kinds and
meanings.  What depends on several keys at once (a step below the end time) is checked by reading a
file, as ``ringsim check`` does.
"""

from typing import Any

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from ringsim.cable.friction import PulleyFriction
from ringsim.cable.records import CABLES
from ringsim.cable.ropes import CableFault
from ringsim.choice import OneOf, kinds_of
from ringsim.reference.keys import Key, keys_of, words_of
from ringsim.reference.tree import ROOTS, facts
from ringsim.refusal import InputError, known_or_nearest
from ringsim.units import LEFT_OUT, Model

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema_of(kind: str) -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of the files of a kind, "scene" or "campaign".

    InputError if there is no such kind.
    """
    if kind not in ROOTS:
        raise InputError(f"--schema {kind}: must be {known_or_nearest(kind, ROOTS)}")
    made = ROOTS[kind].model_json_schema(schema_generator=_Schema)
    inputs = made["properties"].get("inputs")
    if inputs is not None:  # paths may be tables of tables: [inputs.rods] young_modulus = {...}
        one = inputs["additionalProperties"]
        nested = {"type": "object", "additionalProperties": {"$ref": "#/$defs/Inputs"}}
        made["$defs"]["Inputs"] = {"anyOf": [one, nested]}
        inputs["additionalProperties"] = {"$ref": "#/$defs/Inputs"}
        learnt = {
            "type": "object",
            "required": ["file"],
            "additionalProperties": False,
            "properties": {
                "file": {"type": "string"},
                "without": {"type": "array", "items": {"type": "string"}},
            },
        }
        inputs["properties"] = {"from": {"anyOf": [{"type": "string"}, learnt]}}
    return {"$schema": DIALECT, **made, "title": f"{kind} file of ringsim"}


class _Schema(GenerateJsonSchema):
    """What pydantic derives from the records, with families, the word "none", and docstrings."""

    def function_plain_schema(
        self, schema: core_schema.PlainValidatorFunctionSchema
    ) -> JsonSchemaValue:
        """A field that holds any kind of a family."""
        mark: OneOf = schema["metadata"]["one_of"]
        kinds = kinds_of(schema["metadata"]["family"]).items()
        return {"anyOf": [self._kind(name, model, mark) for name, model in kinds]}

    def _kind(self, name: str, model: type[Model], mark: OneOf) -> JsonSchemaValue:
        made = self.generate_inner(model.__pydantic_core_schema__)
        return made if name == mark.default else {"allOf": [made], "required": ["kind"]}

    def model_schema(self, schema: core_schema.ModelSchema) -> JsonSchemaValue:
        """A table with what its keys mean."""
        made, model = super().model_schema(schema), schema["cls"]
        if not issubclass(model, Model):
            return made
        made["description"] = words_of(model)
        properties = made.get("properties", {})
        for key in keys_of(model):
            one = properties[key.name]
            one["description"] = "\n".join(filter(None, [key.meaning, facts(key)]))
            for other in _in_words(key):
                one = properties[key.name] = _either(one, other)
            if key.attribute in model.parts():
                properties[key.name] = _either(one, {"const": LEFT_OUT})
        return made


def _in_words(key: Key) -> list[JsonSchemaValue]:
    """What a key of places on cables may also be: their names; see ``ringsim.cable.records``."""
    if issubclass(key.owner, PulleyFriction) and key.name == "coefficient":
        numbers = {"type": "object", "additionalProperties": {"type": "number"}}
        return [numbers | {"required": ["default"]}]
    if key.takes_a_name:
        return [{"type": "string"}]
    if issubclass(key.owner, CableFault) and key.name == "cable":
        return [{"enum": list(CABLES)}]
    return []


def _either(one: JsonSchemaValue, other: JsonSchemaValue) -> JsonSchemaValue:
    """A value of one kind or the other; what is said of the key stays beside both."""
    said: JsonSchemaValue = {}
    for word in ("title", "description", "default"):
        said |= {word: one.pop(word)} if word in one else {}
    return {"anyOf": [one, other], **said}
