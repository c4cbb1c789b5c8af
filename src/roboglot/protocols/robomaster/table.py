"""The table of this door's commands; the chapters fill it, dispatch.py reads it."""

from roboglot.operations import OperationTable

TABLE: OperationTable[str] = OperationTable("robomaster")
