"""The interface's description in OpenAPI 3.1, made of the table of endpoints."""

from typing import Any, Final

import msgspec

from sa_hub.page.access import COOKIE
from sa_hub.page.asking import Fault
from sa_hub.page.endpoints import ENDPOINTS, ROOT, Endpoint
from sa_hub.page.live import LIVE_PATH

_REFERENCE: Final = "#/components/schemas/{name}"
_REFUSALS: Final = {
    "400": "not JSON",
    "401": "no token, or one that is not known",
    "403": "the role may not, or the request comes from another site",
    "404": "no such thing",
    "413": "the body is too large",
    "422": "a value is not as described",
    "429": "too many requests",
}


def openapi() -> dict[str, Any]:
    """The whole document."""
    types = [Fault, *(type_ for each in ENDPOINTS for type_ in _types(each))]
    schemas, components = msgspec.json.schema_components(types, ref_template=_REFERENCE)
    schema_of = {id(type_): schema for type_, schema in zip(types, schemas, strict=True)}
    return {
        "openapi": "3.1.0",
        "info": {
            "title": "bootprint command post",
            "version": "1",
            "description": (
                "The picture of a squad and what a command post may say. Times are UTC seconds of event time, "
                f"angles degrees clockwise from true north. `{LIVE_PATH}` is a WebSocket: it sends a PictureView "
                "with everything, then one with what is new, several times a second."
            ),
        },
        "components": {
            "schemas": components,
            "securitySchemes": {
                "token": {"type": "http", "scheme": "bearer"},
                "session": {"type": "apiKey", "in": "cookie", "name": COOKIE},
            },
        },
        "security": [{"token": []}, {"session": []}, {}],
        "paths": _paths(schema_of),
    }


def _types(endpoint: Endpoint) -> list[Any]:
    return [each for each in (endpoint.answer, endpoint.body, endpoint.query) if each is not None]


def _paths(schema_of: dict[int, Any]) -> dict[str, Any]:
    paths: dict[str, Any] = {}
    for each in ENDPOINTS:
        paths.setdefault(ROOT + each.path, {})[each.method.lower()] = _operation(each, schema_of)
    return paths


def _operation(endpoint: Endpoint, schema_of: dict[int, Any]) -> dict[str, Any]:
    operation: dict[str, Any] = {
        "summary": endpoint.summary,
        "operationId": endpoint.handler.__name__,
        "description": f"Needs the role `{endpoint.role}`.",
        "parameters": [*_path_parameters(endpoint), *_query_parameters(endpoint)],
        "responses": {
            "200": _content("done", schema_of[id(endpoint.answer)], endpoint.media),
            **{status: _content(why, schema_of[id(Fault)]) for status, why in _REFUSALS.items()},
        },
    }
    if endpoint.body is not None:
        body = {"schema": schema_of[id(endpoint.body)]}
        operation["requestBody"] = {"required": True, "content": {"application/json": body}}
    return operation


def _content(description: str, schema: Any, media: str = "application/json") -> dict[str, Any]:
    return {"description": description, "content": {media: {"schema": schema}}}


def _path_parameters(endpoint: Endpoint) -> list[dict[str, Any]]:
    names = [part[1:-1] for part in endpoint.path.split("/") if part.startswith("{")]
    return [{"name": name, "in": "path", "required": True, "schema": {"type": "string"}} for name in names]


def _query_parameters(endpoint: Endpoint) -> list[dict[str, Any]]:
    if endpoint.query is None:
        return []
    _, components = msgspec.json.schema_components([endpoint.query])
    schema = components[endpoint.query.__name__]
    needed = schema.get("required", [])
    return [
        {"name": name, "in": "query", "required": name in needed, "schema": inner}
        for name, inner in schema["properties"].items()
    ]
