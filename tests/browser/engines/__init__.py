"""Tests of the pages in Firefox and in WebKit."""
