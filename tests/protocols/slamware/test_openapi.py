"""The description is of exactly what is served, and the page needs nothing from elsewhere."""

import re

import httpx

from roboglot.protocols.slamware.openapi import document, summaries
from roboglot.protocols.slamware.routes import ALIASES
from roboglot.protocols.slamware.table import TABLE
from roboglot.wire.contracts import contract


def references(node: object) -> set[str]:
    match node:
        case {"$ref": str(reference)}:
            return {reference}
        case dict():
            return set().union(*map(references, node.values()))
        case list():
            return set().union(*map(references, node))
        case _:
            return set()


def test_it_describes_what_is_served_and_nothing_else() -> None:
    described = document()
    keys = {f"{method.upper()} {path}" for path, methods in described["paths"].items() for method in methods}
    assert keys == {operation.key for operation in TABLE} | ALIASES.keys()
    ids = [operation["operationId"] for methods in described["paths"].values() for operation in methods.values()]
    assert len(set(ids)) == len(ids)
    schemas = described["components"]["schemas"]
    assert [name for name in schemas if "." in name] == []  # two types of one name: msgspec adds their modules
    for reference in references(described):
        assert reference.rpartition("/")[2] in schemas, reference


def test_parameters_bodies_and_answers() -> None:
    paths = document()["paths"]
    (usage, number) = paths["/api/core/artifact/v1/lines/{usage}/{id}"]["delete"]["parameters"]
    assert (usage["name"], usage["in"], usage["required"]) == ("usage", "path", True)
    assert number["schema"] == {"type": "integer"}
    window = paths["/api/core/slam/v1/maps/explore"]["get"]
    assert {(p["name"], p["in"], p["required"]) for p in window["parameters"]} >= {("min_x", "query", False)}
    assert "application/octet-stream" in window["responses"]["200"]["content"]
    upload = paths["/api/multi-floor/map/v1/stcm"]
    assert "application/octet-stream" in upload["post"]["requestBody"]["content"]
    assert "204" in upload["delete"]["responses"]
    result = paths["/api/core/motion/v1/actions/{action_id}"]["get"]["responses"]["200"]
    assert len(result["content"]["application/json"]["schema"]["oneOf"]) == 2
    create = paths["/api/core/motion/v1/actions"]["post"]
    assert create["summary"]


def test_answers_list_the_words_they_have() -> None:
    schemas = document()["components"]["schemas"]
    assert schemas["Box"]["properties"]["door_status"]["enum"] == ["CLOSED", "CLOSING", "OPEN", "OPENING", "SEMIOPEN"]
    assert schemas["PowerStatus"]["properties"]["sleepMode"]["enum"] == ["asleep", "awake", "waking_up"]
    stages = schemas["IndustryResult"]["properties"]["stage"]
    assert {"WAIT_OPERATION", "IN_ELEVATOR", "GOING_TO_TARGET_POINT"} <= set(stages["enum"])
    assert "" not in stages["enum"]  # a stage that there is not is left out
    assert "default" not in stages


def test_every_operation_has_a_chinese_summary() -> None:
    assert summaries().keys() == {row.name for row in contract("slamware")}
    assert all(re.search("[\u4e00-\u9fff]", text) for text in summaries().values())


async def test_page_and_description_are_served(bare_client: httpx.AsyncClient) -> None:
    described = await bare_client.get("/openapi.json")
    assert described.json()["openapi"].startswith("3.")
    page = await bare_client.get("/")
    assert page.headers["content-type"].startswith("text/html")
    assert (await bare_client.get("/index.html")).content == page.content
    texts = [page.text]
    for path in re.findall('(?:src|href)="([^"]+)"', page.text):
        if path == "data:,":
            continue  # no icon, so no request for one
        assert path.startswith("/")
        part = await bare_client.get(path)
        assert part.status_code == 200, path
        texts.append(part.text)
    assert len(texts) == 4
    assert not any("://" in text for text in texts)
    assert (await bare_client.get("/page/../server.py")).status_code == 404
    assert (await bare_client.post("/")).status_code == 405
