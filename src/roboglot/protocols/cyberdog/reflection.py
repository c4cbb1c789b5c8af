"""gRPC server reflection, for tools like grpcurl: the services and the types of their messages.

Describes the few messages needed for it here, to avoid a further package. Knows no handler.
"""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Any

import grpc
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb

VERSIONS = ("grpc.reflection.v1", "grpc.reflection.v1alpha")  # the same messages under two names
QUESTIONS_MAX = 1000  # per call
NOT_FOUND = grpc.StatusCode.NOT_FOUND.value[0]
STRING, INT32, BYTES, MESSAGE = 9, 5, 12, 11  # as FieldDescriptorProto numbers them
# Message: its fields as (name, number, kind or message, repeated).
MESSAGES: dict[str, tuple[tuple[str, int, int | str, bool], ...]] = {
    "ServerReflectionRequest": (
        ("host", 1, STRING, False),
        ("file_by_filename", 3, STRING, False),
        ("file_containing_symbol", 4, STRING, False),
        ("list_services", 7, STRING, False),
    ),
    "FileDescriptorResponse": (("file_descriptor_proto", 1, BYTES, True),),
    "ServiceResponse": (("name", 1, STRING, False),),
    "ListServiceResponse": (("service", 1, "ServiceResponse", True),),
    "ErrorResponse": (("error_code", 1, INT32, False), ("error_message", 2, STRING, False)),
    "ServerReflectionResponse": (
        ("valid_host", 1, STRING, False),
        ("original_request", 2, "ServerReflectionRequest", False),
        ("file_descriptor_response", 4, "FileDescriptorResponse", False),
        ("list_services_response", 6, "ListServiceResponse", False),
        ("error_response", 7, "ErrorResponse", False),
    ),
}
# Fields of which at most one is set; their presence is explicit.
CHOICES = frozenset({"file_by_filename", "file_containing_symbol", "list_services"})


def add_reflection(server: Any) -> None:
    """Let ``server`` list its services."""
    for package in VERSIONS:
        kinds = _kinds(package)
        request, response = kinds["ServerReflectionRequest"], kinds["ServerReflectionResponse"]
        handler = grpc.stream_stream_rpc_method_handler(
            _answering(response), request.FromString, response.SerializeToString
        )
        methods = {"ServerReflectionInfo": handler}
        server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler(f"{package}.ServerReflection", methods),))


def _answering(response: Any) -> Any:
    async def answer(questions: AsyncIterator[Any], _context: Any) -> AsyncIterator[Any]:
        count = 0
        async for question in questions:
            yield _answer(question, response(valid_host=question.host, original_request=question))
            if (count := count + 1) >= QUESTIONS_MAX:
                return

    return answer


def _answer(question: Any, answer: Any) -> Any:
    service = pb.DESCRIPTOR.services_by_name["GrpcApp"].full_name
    match question.WhichOneof("message_request"):
        case "list_services":
            for name in (service, *(f"{package}.ServerReflection" for package in VERSIONS)):
                answer.list_services_response.service.add(name=name)
        case "file_by_filename" if question.file_by_filename == pb.DESCRIPTOR.name:
            answer.file_descriptor_response.file_descriptor_proto.append(pb.DESCRIPTOR.serialized_pb)
        case "file_containing_symbol" if _ours(question.file_containing_symbol, service):
            answer.file_descriptor_response.file_descriptor_proto.append(pb.DESCRIPTOR.serialized_pb)
        case _:
            answer.error_response.error_code = NOT_FOUND
            answer.error_response.error_message = "not described here"
    return answer


def _ours(symbol: str, service: str) -> bool:
    """Return whether ``symbol`` names the service, one of its methods or a message."""
    package, _, name = symbol.rpartition(".")
    return (
        symbol == service
        or (package == service and name in pb.DESCRIPTOR.services_by_name["GrpcApp"].methods_by_name)
        or (package == pb.DESCRIPTOR.package and name in pb.DESCRIPTOR.message_types_by_name)
    )


def _kinds(package: str) -> dict[str, Any]:
    """Return the classes of MESSAGES, in a separate pool."""
    file = descriptor_pb2.FileDescriptorProto(name=f"{package}.proto", package=package, syntax="proto3")
    for name, fields in MESSAGES.items():
        message = file.message_type.add(name=name)
        if any(field[0] in CHOICES for field in fields):
            message.oneof_decl.add(name="message_request")
        for field, number, kind, repeated in fields:
            added = message.field.add(name=field, number=number, label=3 if repeated else 1)
            added.type = MESSAGE if isinstance(kind, str) else kind
            if isinstance(kind, str):
                added.type_name = f".{package}.{kind}"
            if field in CHOICES:
                added.oneof_index = 0
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return {name: message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{package}.{name}")) for name in MESSAGES}
