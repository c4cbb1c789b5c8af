"""Asserts that the plugin lets pytest rewrite."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from _pytest.assertion.rewrite import AssertionRewritingHook

import roboglot.testing
from roboglot.testing.plugin import pytest_load_initial_conftests


def test_kit_imported_early_is_marked_without_warning(
    pytestconfig: pytest.Config, monkeypatch: pytest.MonkeyPatch
) -> None:
    """pytest 9.0 and 9.1 import an editable installation's kit before anything is marked; warnings are errors here."""
    hook = AssertionRewritingHook(pytestconfig)
    hook.mark_rewrite("roboglot")
    monkeypatch.setattr(roboglot.testing, "__loader__", None)
    pytest_load_initial_conftests(SimpleNamespace(pluginmanager=SimpleNamespace(rewrite_hook=hook)))  # type: ignore[arg-type]
    assert hook._must_rewrite == {"roboglot.testing"}
